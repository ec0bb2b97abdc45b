; Rapid motion over most of the travel, alone and together; each axis at its own 40 m/min.
N10 G54 G90 SOFT
N20 G0 X450
N30 G0 X-450 Y-350 Z250
N40 G0 X0 Y350 Z-250
N50 G0 Y-350
N60 BRISK
N70 G0 X400 Y300
N80 G0 Z250
N90 SOFT
N100 G0 X0 Y0 Z0
N110 M30
