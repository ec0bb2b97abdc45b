//! Errors of the geometry stage.

use super::messages;

messages! {
    OUT_OF_RANGE = 150, "axis {} leaves the range of positions",
        "Positions are counted in steps, 2^31 either way. The point, the centre of the circle or the curve between two points lies beyond that.",
        "Check the coordinate for a missing decimal point and the unit (G70, G71); check steps per unit in the machine file.";
    NOT_FINITE = 151, "the curve has no finite slope",
        "The numbers of the block are so large, or points lie so close together, that a slope overflows.",
        "Check the coefficients, knot intervals and weights of this block; leave out points that nearly coincide.";
    G6_GAP = 153, "G6 starts {} nm (or 1e-6 degree) from the end of the block before it in axis {}; 2000 are allowed",
        "A G6 block runs from P(I) to its printed end point. P(I) must be where the path stands; rounding of the printed numbers explains 2 micrometres.",
        "Check K1 K2 K3 and I of this block for a lost digit, and that the block before it is there and ends where it should.";
    WEIGHT = 156, "weights must be 0 or more, and not 0 on all points of a span",
        "The curve is an average of its control points. Negative weights, or weights that are all zero, leave no average.",
        "Check PW (Fanuc: R) of this point and the ones before it.";
    ARC_RADII = 159, "radius is {} mm at the start of the arc and {} mm at its end",
        "Start and end must lie on one circle about the programmed centre; the machine file says how far they may miss it (arc tolerance).",
        "Check the end point and I J K: they count from the start point unless AC() is given. Check that the start point is where the program thinks it is.";
    ARC_REACH = 160, "CR is {} mm, half the way from start to end is {} mm",
        "No circle of this radius passes through both points.",
        "Check CR, the end point, and that the start point is where the program thinks it is.";
    ARC_NO_RADIUS = 161, "the arc has no radius",
        "The centre lies on the start or the end point, or CR is zero.",
        "Program the centre with I J K of the working plane (G17 G18 G19), or CR greater than zero.";
    ARC_PLANE = 163, "the machine lacks an axis of the plane of the arc",
        "A circle needs both axes of the working plane.",
        "Select another plane with G17, G18 or G19.";
    DENOMINATOR = 164, "the denominator vanishes on the way",
        "A rational curve goes to infinity where its denominator is zero; it must stay greater than zero from start to end.",
        "Check PO[] (value at the end, then b2 to b5), or the weights of the spline.";
    STEEP = 165, "the curve is too steep to be followed within its tolerance",
        "Cubic segments of a millionth of the block still miss the curve by more than the curve tolerance of the machine file.",
        "Check the coefficients or weights of this block; split it into several.";
    TOO_FEW_POINTS = 166, "the spline needs {} points, its start among them, and has {}",
        "A B-spline needs one point more than its degree. Not-a-knot ends (BAUTO, EAUTO) need three points, other ends of A- and C-splines two.",
        "Program more points, another end condition (BNAT, BTAN), or G1 for a single move. A block of another kind, a stop or a dwell ends a spline.";
    TOOL_VECTOR = 167, "XH YH ZH give no direction this machine can turn the tool to",
        "The tool points from X Y Z to XH YH ZH. The two coincide, or the machine file names no head.",
        "Check XH YH ZH; name the head in the machine file, or program the rotary axes.";
    TOOL_JUMP = 168, "the rotary axes would have to jump to follow XH YH ZH",
        "The tool vector does not begin at the angles the axes have (0.01 degree allowed), it leaves the pole (tool along Z) in a direction the turning axis does not have, or the curve passes the pole on another side than its points.",
        "Turn the rotary axes to the first vector before the spline; keep the vector away from the pole or lead it straight across.";
}
