; Helix of one turn and a quarter, 8 mm deep.
G54 G90 G64 SOFT
G1 X15 Y0 F9000
G3 X0 Y15 Z-8 I-15 J0 TURN=1
G1 X-20
M30
