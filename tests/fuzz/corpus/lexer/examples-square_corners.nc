; A square at full feed: every corner is an exact stop, by G64 with no corner step on
; the MCV 1210, by G9 for one block and by G60 for the last turn.
N10 G54 G90 G64 SOFT
N20 G0 X-30 Y-30
N30 G1 X30 F6000
N40 Y30
N50 X-30
N60 Y-30
N70 G9 X30 F3000
N80 Y30
N90 G60 X-30
N100 Y-30
N110 G64
N120 G0 X0 Y0
N130 M30
