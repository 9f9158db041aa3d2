//! Tests with thousands of solvers, and with solvers in many threads at the same time.

use myovib_conformance::samples::{Heat2d, Robertson, Sample};
use myovib_dae::Problem;

use sundials_wrap::IdaSolver;

#[test]
fn a_thousand_solvers_are_created_and_dropped() {
    for i in 0..1000 {
        let sample = Heat2d::new(4);
        let start = sample.start();
        let mut solver = IdaSolver::builder(sample).build(0.0, &start.y, &start.y_dot).unwrap();
        if i % 3 == 0 {
            solver.step(1.0).unwrap();
        }
        if i % 2 == 0 {
            assert_eq!(solver.into_problem().n_unknowns(), 16);
        }
    }
}

#[test]
fn solvers_run_in_many_threads_at_once_and_move_between_them() {
    fn assert_send<T: Send>() {}
    assert_send::<IdaSolver<Robertson>>();
    let run = || {
        let start = Robertson.start();
        let mut solver = IdaSolver::builder(Robertson).build(0.0, &start.y, &start.y_dot).unwrap();
        solver.integrate_to(4.0).unwrap();
        std::thread::spawn(move || {
            solver.integrate_to(40.0).unwrap();
            (solver.y().to_vec(), solver.statistics())
        })
        .join()
        .unwrap()
    };
    let expected = run();
    let threads: Vec<_> = (0..64).map(|_| std::thread::spawn(run)).collect();
    for thread in threads {
        assert_eq!(thread.join().unwrap(), expected, "bit for bit, whatever runs beside it");
    }
}
