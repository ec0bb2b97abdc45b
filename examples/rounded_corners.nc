; Corners rounded by cubics: over ADIS mm before and behind them, or within the
; tolerances of the axes. The last points of both turns, before M5 and M30, are met exactly.
N10 G54 G90 SOFT
N20 G641 ADIS=2 ADISPOS=5 F6000
N30 G0 X-30
N40 Y-30
N50 G1 X30
N60 Y30
N70 G3 X10 Y30 I-10 J0
N80 G1 X-30 Y20
N90 Y-30
N100 M5
N110 G642
N120 X30
N130 Y30 A0.2
N140 X-30 A0
N150 Y-30 C0.1
N160 G64 G0 X0 Y0 C0
N170 M30
