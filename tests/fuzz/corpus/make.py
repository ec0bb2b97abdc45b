#!/usr/bin/env python3
"""Writes the seeds of `lexer` and `interpreter` from the example programs, the malformed ones and the words of the language.

    python3 tests/fuzz/corpus/make.py

Seeds are short on purpose: the fuzzer lengthens them itself. The first byte of an `interpreter` seed chooses the
dialect (0, 1, 2 modulo 3: Sinumerik, Fanuc, Heidenhain).
"""

import pathlib

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
LINES = 40

WORDS = {
    "arcs": (0, "G0X10Y0\nG2 X0 Y10 I-10 J0 F500\nG3X10Y0CR=10TURN=2\nG18 G2 X5 Z5 K=AC(3) I2\nG19G3Y1Z1CR-4\n"),
    "poly": (0, "POLY PO[X]=(10,2,-1) PO[Y]=(5,.5,.1,-.2,1) PO[]=(2,1) PL=4\nPOX Q1 Q2\nPOD Q2 Q.5\nX3Y2PL2\n"),
    "nurbs": (0, "BSPLINE SD=3 X1Y2PW=2PL=.5\nX5Y5PW.3\nX9PW0Y1\nX12Y-3PL=0\nX14SPLINEPATH(1,X,Y)\nSPLINEPATH XYZ\n"),
    "ends": (0, "BAUTO EAUTO CSPLINE X1Y1\nX2\nX3Y-1\nETAN BTAN ASPLINE X5\nX7Y7\nG1X9\n"),
    "frames": (0, "G54G0X1\nG55X2\nG56X3\nG57X4\nG500X5\nG53X6\nX=AC(1)Y=IC(2)A=DC(3)\nXIC5YAC2\n"),
    "parameters": (0, "R1=2.5R2=R1*SIN(30)+POT(3)\nX=R1 Y=-R2/(R1+1)F=R1\nR3=ATAN2(1,2)*SQRT(ABS(-4))\nG0X=ROUND(R3 MOD 7)\n"),
    "tools": (0, "G10L1P1R2Z50\nT1M6\nG41G1X5Y5F100\nX10\nG2X20Y0I5J-5\nG451X30\nG40G0X0Y0\nT=\"FR_4\"D0\nD1\n"),
    "feeds": (0, "G93G1X1F2\nG94F100X2\nG95S100F.1X3\nG4F.1\nG4P1\nG4S2\nG75X0\nG74X0Y0\n"),
    "jump": (0, "GOTOF END\nX1\nX2\nEND: G1X1F10\nMSG(\"text\")\nMSG()\nM30\n"),
    "head": (0, "BSPLINE X1Y1Z0XH=1YH=2ZH=10\nX2Y1XH2YH1ZH11\nX3Y1XH3YH1ZH12\nX4\n"),
    "g62": (1, "G06.2P4K0X0Y0R1F500\nK0X1Y2R2\nK0X3Y2\nK0X4Y0\nK1\nK1\nK1\nK1\nG01X0\n"),
    "g62order": (1, "G6.2P3K0X0R1\nK0X1Y1\nK0X2\nK1\nK1K1\nG0X1(comment)\n"),
    "conversation": (2, "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S5000 DL+0.1 DR-.1\n2 L X+10 Y+5 R0 F1000 M3\n3 CC X+0 Y+0\n4 C X-10 Y-5 DR+\n5 CR X+10 Y+5 R-20 DR- F200\n6 L IX+5 IY-2 FMAX\n7 STOP\n8 END PGM A MM\n"),
    "spl": (2, "L X0 Y0 F500\nSPL X10 Y5 K3X0 K2X1 K1X-11\nK3Y.5 K2Y-1 K1Y-4.5 F100\nL RL X3\nRR\n"),
}


def seed(target, name, text):
    path = HERE / target / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(text)


def main():
    programs = sorted((ROOT / "examples").rglob("*.*")) + sorted((ROOT / "tests/malformed").glob("*.nc"))
    for path in programs:
        if path.suffix.lower() not in (".nc", ".mpf", ".spf"):
            continue
        head = b"\n".join(path.read_bytes().splitlines()[:LINES]) + b"\n"
        name = path.relative_to(ROOT).as_posix().replace("/", "-")
        seed("lexer", name, head)
        seed("interpreter", name, b"\0" + head)
    for name, (dialect, text) in WORDS.items():
        seed("lexer", name, text.encode())
        seed("interpreter", name, bytes([dialect]) + text.encode())


if __name__ == "__main__":
    main()
