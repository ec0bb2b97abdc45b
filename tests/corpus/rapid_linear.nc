; Rapid motion over much of the travel.
G54 G90 G64 SOFT
G0 X450
X-450 Y-350 Z250
X0 Y350 Z-250
Y-350
X0 Y0 Z0
M30
