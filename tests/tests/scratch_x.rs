use whole_product_tests::{drive::*, examples};
#[test]
fn x() {
    let config = examples::machine().config;
    for text in ["BRISK\nG0 X400 Y300\nM30\n", "G0 Y-350\nBRISK\nG0 X400 Y300\nG0 Z250\nM30\n", "BRISK\nG0 Z250\nM30\n", "SOFT\nG0 X0 Y350 Z-250\nM30\n", "G1 X14 Y-2 F1800\nBRISK\nG1 X20 Y4\nM30\n", "G1 X14 Y-2 F1800\nG60 X10\nG64\nM30\n"] {
        let mut s = Script::new(text);
        s.limit = 60_000;
        let run = drive(&config, &s);
        println!("XX {text:?} finished {} ticks {} moving {} end {:?}", run.finished, run.ticks.len(), run.moving(), run.end());
    }
}
