; Five axes in one C-spline. A and C turn at 1 degree/s at most, so they bind in the
; middle of the sweep and the tool-path feed has to drop below the programmed 15 mm/s
; there.
N10 G54 G64 G90 SOFT
N20 G1 X0 Y0 Z0 A0 C0 F900
N30 G1 X5 F900
N40 BTAN ETAN
N50 CSPLINE
N60 X12 Y1 Z-0.5 A0.2 C-0.1
N70 X19 Y4 Z-1.2 A0.7 C-0.4
N80 X25 Y9 Z-2.1 A1.5 C-0.9
N90 X30 Y16 Z-2.8 A2.1 C-1.7
N100 X33 Y24 Z-3 A2.3 C-2.4
N110 X35 Y32 Z-2.7 A2 C-2.8
N120 X38 Y40 Z-2 A1.4 C-3
N130 X44 Y46 Z-1.1 A0.8 C-3
N140 X52 Y49 Z-0.4 A0.3 C-2.9
N150 X60 Y50 Z0 A0 C-2.8
N160 G1 X66 F900
N170 M30
