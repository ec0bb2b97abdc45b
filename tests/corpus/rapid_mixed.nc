; Rapid motion of linear and rotary axes together.
G54 G90 G64 SOFT
G0 X100 A2
X-100 Y50 C-3
X0 Y0 Z-40 A0 C0
X200 A0.2
X0 C0.1
A-1 C1
M30
