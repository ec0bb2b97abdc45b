//! One small program for each kind of motion, spelled for the wire: no `=`, no brackets, at most 96 bytes in a line, at
//! most four decimals. Senders may do to them what they like, and the steps must stay the same.

use pentaspline::config::Config;

use crate::campaign::machine;
use crate::oracle::read::{Language, Setup};

/// A program and the words it is written in.
#[derive(Clone, Copy, Debug)]
pub struct WireProgram {
    /// What it shows.
    pub name: &'static str,
    /// Words.
    pub language: Language,
    /// Lines, each ended by `\n`.
    pub text: &'static str,
}

impl WireProgram {
    /// The built-in machine that speaks the program's language.
    #[must_use]
    pub fn machine(&self) -> Config {
        machine(&Setup {
            language: self.language,
            ..Setup::default()
        })
    }
}

const fn sinumerik(name: &'static str, text: &'static str) -> WireProgram {
    WireProgram {
        name,
        language: Language::Sinumerik,
        text,
    }
}

/// All of them.
pub const PROGRAMS: [WireProgram; 15] = [
    sinumerik(
        "lines",
        "N10 G90 G64 SOFT F3000\nN20 G1 X1.5 Y2.25 ; comment\nN30 X10 (comment) Y-0.0625 Z.5\nG9 X0 Y5\nG0 X0 Y0 Z0 A0.5\n\
         G91 G1 XAC4 YIC1\nX1 C-0.25\nM30\n",
    ),
    sinumerik(
        "Akima",
        "G1 F3000 X5\nBTAN ETAN ASPLINE X10 Y3\nX15 Y-2 Z1.25\nX20 Y0 A0.2\nG1 X25 Y0\nBNAT EAUTO ASPLINE X30 Y4.125\n\
         X35 Y-3.0625\nX40 Y0.5\nG1 X40 Y10\nM30\n",
    ),
    sinumerik(
        "cubic",
        "G1 F3000 X5\nBAUTO EAUTO\nCSPLINE X10 Y3\nX15 Y-2 Z1 ; on\nX20 Y0 C0.4\nX22 Y0.0004\n(last) X30 Y4\n\
         BNAT ETAN CSPLINE X35 Y-3\nX40 Y0\nG1 X50 Y-5\nM30\n",
    ),
    sinumerik(
        "rational",
        "F3000\nBSPLINE SD2 X5 Y5 PW0.5\nX10 Y-5 PL2\nX15 Y0 PW3\nG1 X20\nBSPLINE SD3 X22 Y2 PL0.5\nX24 Y-2 PW2.2525\n\
         X26 Y2 Z0.5\nX28 Y0 PL1.5\nX30 Y1\nG1 X35\nM30\n",
    ),
    sinumerik(
        "spline path",
        "G1 F3000 X1\nSPLINEPATH XY\nASPLINE X5 Y4 C0.2\nX9 Y1 C0.1\nX15 Y3 Z2\nX20 Y0\nSPLINEPATH XYZAC\n\
         CSPLINE X25 Y3 C0.5\nX30 Y-2\nX35 Y0 A-0.25\nM30\n",
    ),
    sinumerik(
        "tool vector",
        "F600\nBSPLINE X1 Y0 XH1 YH0 ZH100\nX2 Y0 XH2 YH-0.05 ZH100\nX3 Y0 XH3 YH-0.1 ZH100\nX4 Y0.5 XH4 YH0.4 ZH100\nM30\n",
    ),
    sinumerik(
        "circles",
        "F1500\nG1 X10 Y0\nG3 X0 Y10 I-10 J0\nG2 X10 Y0 CR10\nG2 X10 Y20 CR-12\nG17 G3 X10 Y20 I-10 TURN1 Z-2\n\
         G18 G2 X10 Z-2 IAC5 KAC-2\nG19 G3 Y20 Z-2 JAC15 KAC-2\nG17 G3 X20 Y10 I0 J-10 C0.2\nM30\n",
    ),
    sinumerik(
        "polynomials",
        "F1500 G1 X10 Y0\nPOLY POX Q-10 POD Q2 Q1\nX0 Y10 PL1\nPOX Q0.5 Q-0.1\nPOY Q0.3125 Q0.01 Q-0.0025 Q0.0001\n\
         X5 Y12 PL2\nG1 X0 Y0\nM30\n",
    ),
    sinumerik(
        "System 800",
        "F3000\nG6 X10 Y2 I10\nK0 K0 K-268435456\nK0 K21990233 K-80530637\nG6 X20 Y3 I10\nK0 K0 K-268435456\n\
         K0 K-43980465 K26843546\nM30\n",
    ),
    sinumerik(
        "cutter",
        "G10 L1 P3 R1.5 Z0\nT3 M6\nF1500\nG0 X-10 Y-10\nG41 G450 G1 X0 Y0\nY20\nX20 CFTCP\nG2 X30 Y10 CR10 CFIN\nG1 Y0 CFC\n\
         X0\nG40 X-10 Y-10\nG42 G451 X0 Y0\nX20\nCSPLINE X25 Y5\nX20 Y15\nX10 Y20\nG1 X0\nY0\nG40 X-10 Y-10\nM30\n",
    ),
    sinumerik(
        "words of GRBL",
        "G17 G90 G94\nG10 L1 P1 R2 Z25\nT1 M6\nG53 G0 Z30\nG54 F1200\nG1 X10\nG3 X0 Y10 I-10 J0\nG4 P0.05\nG93 G1 X5 Y5 F60\n\
         G94 F900 M3 S5000\nX0 Y0 Z5\nM5\nM2\n"
    ),
    sinumerik(
        "frames and jump",
        "F1200\nG500 G1 X5\nGOTOF BEGIN\nX100 Q5\nBEGIN:\nG54 G1 X8 Y2\nG70 F50 X0.5\nG71 F1200 G60 X5\nG95 S600 F1.5 X0 Y0\nM30\n",
    ),
    WireProgram {
        name: "Fanuc",
        language: Language::Fanuc,
        text: "G90 G94 F1200\nG01 X1 Y0\nG06.2 P4 K0 X1 Y0 R1\nK0 X5 Y10 R0.5\nK0 X15 Y10 R2\nK0 X20 Y0 (comment)\n\
               K0.5 X25 Y-10\nK1\nK1\nK1\nK1\nG01 X30 Y0\nG02 X35 Y5 I5 J0\nM30\n",
    },
    WireProgram {
        name: "Heidenhain",
        language: Language::Heidenhain,
        text: "0 BEGIN PGM A MM\n1 L X+10 Y+5 R0 F3000 ; comment\n2 L IX+20 IY-2.5 C+0.1\n3 CC X+20 Y+2.5\n4 C X+10 Y+2.5 DR+\n\
               5 CR X+20 Y+12.5 R+10 DR-\n6 L Z+3 FMAX\n7 TOOL CALL 1 Z S5000\n8 L X+0 Y+0 Z-0 R0 F1500\n9 END PGM A MM\n",
    },
    WireProgram {
        name: "Heidenhain splines",
        language: Language::Heidenhain,
        text: "0 BEGIN PGM A MM\n1 L X+1 Y+2 Z+0 F3000\n2 SPL X+11 Y+5 Z+1 K3X+1 K2X-1.5 K1X-9.5\nK3Y+2 K2Y-4 K1Y-1\n\
               K3Z+0 K2Z+0 K1Z-1\n3 SPL X+20 Y+4 Z+1 K3X+0.5 K2X+0 K1X-9.5\nK3Y-1.5 K2Y+1.5 K1Y+1\nK3Z+0 K2Z+0 K1Z+0\n\
               4 END PGM A MM\n",
    },
];
