G1 X5 F3000
X9 (and then
X400
