//! First light.
use whole_product_tests::{drive::*, laws};
use host_sim::machine_file::Machine;

fn show(name: &str, text: &str) {
    let machine = Machine::built_in().unwrap();
    let config = machine.config;
    let run = drive(&config, &Script::new(text));
    let p = laws::peaks(&config, &run);
    println!("{name}: finished {} ticks {} end {:?} digest {:016x}\n v {:.4?}\n a {:.4?}\n j {:.4?} worst {}\n{}", run.finished, run.ticks.len(), run.end(), run.digest, p.v, p.a, p.j, p.worst_tick, run.output.lines().filter(|l| *l != "ok" && !l.is_empty()).collect::<Vec<_>>().join("\n"));
    println!("{:?}", laws::emits_exactly_the_commanded_steps(&run));
}

#[test]
fn line() { show("line", "G1 X10 F1500\nM30\n"); }
#[test]
fn rapid() { show("rapid", "G0 X400 Y-200 Z50\nM30\n"); }
#[test]
fn tiny() { show("tiny", "G1 X0.001 F1500\nX0.002\nX0.010\nX0\nX0.1\nM30\n"); }
#[test]
fn corner() { show("corner", "G1 X10 F1500\nY10\nX0 Y0\nM30\n"); }
#[test]
fn spline() { show("spline", "G64 SOFT\nG1 X10 F1530\nBNAT ENAT\nCSPLINE X12 Y3\nX15 Y5\nX20 Y3\nX25 Y6\nX30 Y0\nG1 X40\nM30\n"); }
