F600 POLY
PO[X]=(1) PO[]=(-1,0)
