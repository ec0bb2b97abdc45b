n10g54g90g64soft
n20 g1x1.5y2.5f1500
N30BNATENAT
N40CSPLINEX6.Y5

X10Y+3.25
n60 x.5e1 y-2
X0 Y-0 ; minus zero, as one sender rounds it
x-00004.50y-3.000000
(comments in both forms)
N90 G01 X-6 Y0 F0900 (one between words) Z.25
N90 G1X-6Y0Z.25 ; the point where the tool is: no motion
G0X0Y0Z0
M30
