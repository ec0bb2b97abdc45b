; Circle of 20 mm radius, touched tangentially, two turns.
G54 G90 G64 SOFT
G1 X20 Y-30 F6000
Y0
G3 X20 Y0 I-20 TURN=1
G1 Y30
M30
