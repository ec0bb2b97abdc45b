//! First light.
use host_sim::machine_file::Machine;
use whole_product_tests::{drive::*, laws};

#[test]
fn examples() {
    let only = std::env::var("ONLY").unwrap_or_default();
    let machine = Machine::built_in().unwrap();
    let config = machine.config;
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let mut files = vec![];
    for d in ["", "golden", "thesis"] {
        for e in std::fs::read_dir(root.join(d)).unwrap() {
            let p = e.unwrap().path();
            if p.extension().is_some_and(|e| e == "nc" || e == "MPF")
                && p.to_string_lossy().contains(&only)
            {
                files.push(p);
            }
        }
    }
    files.sort();
    for f in files {
        let program = host_sim::program::Program::load(&f).unwrap();
        let text: String = program
            .lines()
            .map(|l| format!("{}\n", String::from_utf8_lossy(l)))
            .collect();
        let run = drive(&config, &Script::new(&text));
        let p = laws::peaks(&config, &run);
        println!("{:?}: finished {} ticks {} end {:?} digest {:016x}\n v {:.4?}\n a {:.4?}\n j {:.4?} worst {} line {}\n{}", f.file_name().unwrap(), run.finished, run.ticks.len(), run.end(), run.digest, p.v, p.a, p.j, p.worst_tick, run.ticks[p.worst_tick].block, run.output.lines().filter(|l| *l != "ok" && !l.is_empty()).collect::<Vec<_>>().join("\n"));
        let first = (3..run.ticks.len())
            .find(|&i| {
                (0..5).any(|a| {
                    let c = &config.axes[a];
                    let g = |k: usize| {
                        run.ticks[k].commanded[a] as f64
                            / 4294967296.0
                            / c.steps_per_unit.to_num::<f64>()
                    };
                    ((g(i) - 3. * g(i - 1) + 3. * g(i - 2) - g(i - 3)) * 125e9).abs()
                        > 1.02 * c.j_max as f64
                })
            })
            .unwrap_or(4);
        if p.j.iter().any(|j| *j > 1.005) {
            for t in first.max(6) - 6..(first + 6).min(run.ticks.len()) {
                let k = &run.ticks[t];
                println!(
                    "   {t} b{} feed {:.6} {:?}",
                    k.block,
                    k.feed,
                    k.commanded.map(|c| c as f64 / 4294967296.0)
                );
            }
        }
        if let Err(e) = laws::emits_exactly_the_commanded_steps(&run) {
            println!("STEPS {e}");
        }
    }
}
