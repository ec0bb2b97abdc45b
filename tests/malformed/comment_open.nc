F600
X1 (left open
