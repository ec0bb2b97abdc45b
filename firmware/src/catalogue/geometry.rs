//! Errors of the geometry stage.

use super::messages;

messages! {
    OUT_OF_RANGE = 150, "axis {} leaves the range of positions",
        "",
        "";
    NOT_FINITE = 151, "the curve has no finite slope",
        "",
        "";
    FEED = 152, "the feed must be greater than zero",
        "",
        "";
    G6_GAP = 153, "G6 starts {} nm (or 1e-6 degree) from the end of the block before it in axis {}; 2000 are allowed",
        "",
        "";
    G6_LENGTH = 154, "I of a G6 block must be greater than zero",
        "",
        "";
    DEGREE = 155, "SD must be 2 or 3 and may not change inside a spline",
        "",
        "";
    WEIGHT = 156, "PW must be the same, and not 0, on all control points",
        "",
        "";
    KNOT_INTERVAL = 157, "PL must be greater than zero",
        "",
        "";
    NOT_DRAINED = 158, "segments of the block before are still waiting",
        "",
        "";
}
