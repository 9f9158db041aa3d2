//! Tests of passes distributed among processes or threads, compared with passes of the whole solid.

use std::sync::{Arc, Mutex};

use myovib_fem::material::{ActiveStress, Law};
use myovib_fem::{
    AddedMotion, AddedStress, AddedTangents, Barycentric, DofMap, Fields, Inverted,
    ParallelAssembler, Pass, Pressure, Solid, Space, Tangents, Vectors, generate,
};

use rayon::ThreadPoolBuilder;

use crate::common::{DENSITY, MUSCLE_LAW, SMALL_LAW, random};

const RANKS: usize = 3;

/// Returns a solid with two laws. Elements with the second law have an added stress.
fn solid(cells: [usize; 3]) -> Solid {
    let mesh = generate::block([0.0; 3], [1.0, 0.8, 0.6], cells).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let n = mesh.n_elements();
    let laws: Vec<Law> = (0..n).map(|e| if e % 3 == 0 { SMALL_LAW } else { MUSCLE_LAW }).collect();
    let stress = AddedStress { active: Some(ActiveStress::PLAIN), viscosity: 70.0 };
    let members = (0..n).filter(|e| e % 3 == 1).collect();
    Solid::new(space, dofs, laws, DENSITY)
        .unwrap()
        .with_added_stresses(&[(members, stress)])
        .unwrap()
}

/// Simulates the other partitions within this process. Their results are computed when a pass begins.
#[derive(Debug)]
struct Others {
    partitions: Vec<Solid>,
    computed: Mutex<Vec<Computed>>,
}

type Computed = (Vec<Vec<f64>>, Result<(), Inverted>);

impl ParallelAssembler for Others {
    fn begin(&self, pass: &Pass<'_>) {
        let compute = |solid: &Solid| {
            let mut results = Vec::new();
            let ended = solid.compute(pass, &mut results);
            results.retain(|vector| !vector.is_empty());
            (results, ended)
        };
        *self.computed.lock().unwrap() = self.partitions.iter().map(compute).collect();
    }

    fn end(&self, results: &mut [&mut [f64]], own: Result<(), Inverted>) -> Result<(), Inverted> {
        own?;
        for (others, ended) in self.computed.lock().unwrap().drain(..) {
            ended?;
            assert_eq!(results.len(), others.len());
            for (sum, other) in results.iter_mut().zip(others) {
                assert_eq!(sum.len(), other.len());
                sum.iter_mut().zip(other).for_each(|(sum, x)| *sum += x);
            }
        }
        Ok(())
    }
}

fn distributed(whole: &Solid) -> Solid {
    let partition = |number| whole.clone().share(number, RANKS);
    let others =
        Others { partitions: (1..RANKS).map(partition).collect(), computed: Mutex::default() };
    whole.clone().with_assembler(Arc::new(others), RANKS)
}

/// Asserts that results are equal up to rounding. Sums of about a hundred terms in a different order have an error
/// of ε for each term.
fn assert_same(a: &[f64], b: &[f64]) {
    let largest = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(largest > 0.0, "the result must not vanish");
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= 100.0 * f64::EPSILON * largest, "{a} {b}");
    }
}

/// Returns every result of every pass at a random state.
fn all_results(solid: &Solid) -> Vec<Vec<f64>> {
    let (n, m) = (solid.space().n_components(), solid.space().n_pressures());
    let (u, v) = (random(n, 0.01, 1), random(n, 0.3, 2));
    let (p, p_rate, mu) = (random(m, 1e3, 3), random(m, 1e3, 4), random(m, 1.0, 5));
    let fields = Fields {
        v: Some(&v),
        p_rate: Some(&p_rate),
        mu: Some(&mu),
        ..Fields::new(&u, Pressure::Nodal(&p))
    };
    let (square, wide) = (solid.displacement_pattern().nnz(), solid.divergence_pattern().nnz());
    let tensions = vec![3e3; solid.n_tensions()];
    let motion = AddedMotion { u: &u, v: &v, tensions: &tensions };
    let mut results: Vec<Vec<f64>> = [n, n, m, m, n, square, square, square, wide, wide, square]
        .into_iter()
        .chain([n, n, square, square])
        .map(|n| vec![f64::NAN; n])
        .collect();
    let mut vectors = results.iter_mut().map(|vector| &mut vector[..]);
    let mut out = Vectors {
        force: vectors.next(),
        force_rate: vectors.next(),
        volume_residual: vectors.next(),
        volume_residual_rate: vectors.next(),
        multiplier_force: vectors.next(),
    };
    solid.evaluate(&fields, &mut out).unwrap();
    let mut out = Tangents {
        stiffness: vectors.next(),
        damped_stiffness: vectors.next(),
        rate_stiffness: vectors.next(),
        divergence: vectors.next(),
        divergence_rate: vectors.next(),
        multiplier_stiffness: vectors.next(),
    };
    solid.tangents(&fields, &mut out).unwrap();
    solid.added_force(&motion, vectors.next().unwrap());
    solid.active_force(&motion, vectors.next().unwrap());
    let out = AddedTangents { by_displacement: vectors.next(), by_velocity: vectors.next() };
    solid.added_tangents(&motion, out);
    drop(vectors);
    results
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    // 960 elements form 120 batches. Fewer batches are computed before an addition.
    let alone = solid([10, 4, 4]);
    assert_eq!(alone.space().n_elements(), 960);
    let expected = all_results(&alone);
    for threads in [1, 2, 3] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let together = alone.clone().in_threads(Some(Arc::new(pool.unwrap())));
        for (number, (a, b)) in expected.iter().zip(all_results(&together)).enumerate() {
            let same = a.iter().zip(&b).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same, "result {number} with {threads} threads");
        }
        // If many elements are inverted, the first of them is reported.
        let u = random(alone.space().n_components(), 1.0, 6);
        let p = vec![0.0; alone.space().n_pressures()];
        let [first, reported] = [&alone, &together].map(|solid| {
            let mut force = vec![0.0; u.len()];
            let mut out = Vectors { force: Some(&mut force), ..Vectors::default() };
            solid.evaluate(&Fields::new(&u, Pressure::Nodal(&p)), &mut out).unwrap_err()
        });
        assert_eq!(first, reported);
    }
}

#[test]
fn partitions_sum_to_the_whole() {
    let whole = solid([3, 2, 2]);
    let together = distributed(&whole);
    let (n, m) = (whole.space().n_components(), whole.space().n_pressures());
    let u = random(n, 0.01, 1);
    for (a, b) in all_results(&whole).iter().zip(all_results(&together)) {
        assert_same(a, &b);
    }
    // Results that are not requested are neither computed nor summed.
    let mut residuals = [vec![0.0; m], vec![0.0; m]];
    for (solid, volume_residual) in [&whole, &together].into_iter().zip(&mut residuals) {
        let mut out = Vectors { volume_residual: Some(volume_residual), ..Vectors::default() };
        solid.evaluate(&Fields::new(&u, Pressure::Penalty { kappa: 1e5 }), &mut out).unwrap();
    }
    assert_same(&residuals[0], &residuals[1]);
}

#[test]
fn every_element_is_in_exactly_one_partition() {
    let whole = solid([3, 2, 2]);
    let weight = |solid: &Solid| {
        let mut force = vec![0.0; whole.space().n_components()];
        let u: Vec<f64> = whole.space().coordinates().iter().map(|x| 0.1 * x).collect();
        let mut volume_residual = vec![0.0; whole.space().n_pressures()];
        let mut out = Vectors {
            force: Some(&mut force),
            volume_residual: Some(&mut volume_residual),
            ..Vectors::default()
        };
        solid.evaluate(&Fields::new(&u, Pressure::Penalty { kappa: 0.0 }), &mut out).unwrap();
        volume_residual.iter().sum::<f64>()
    };
    let all = weight(&whole);
    for ranks in [1, 2, 5, 100] {
        let partitions: Vec<f64> =
            (0..ranks).map(|k| weight(&whole.clone().share(k, ranks))).collect();
        let sum: f64 = partitions.iter().sum();
        assert!((sum - all).abs() <= 1e3 * f64::EPSILON * all.abs(), "{ranks}: {sum} {all}");
        let most = partitions.iter().fold(0.0_f64, |m, x| m.max(*x));
        assert!(ranks == 1 || most < 0.75 * all, "{ranks}: {most} of {all}");
    }
}

#[test]
fn inverted_elements_in_other_partitions_are_reported() {
    let whole = solid([3, 2, 2]);
    let together = distributed(&whole);
    // The last corner is moved through the body. It belongs to elements of the last partition.
    let mut u = vec![0.0; whole.space().n_components()];
    let d = whole.space().dimension();
    let far = |x: &[f64]| x.iter().sum::<f64>();
    let corner = whole.space().coordinates().chunks(d).map(far).fold(0.0, f64::max);
    for (x, u) in whole.space().coordinates().chunks(d).zip(u.chunks_mut(d)) {
        if far(x) == corner {
            u.fill(-1.0);
        }
    }
    let p = vec![0.0; whole.space().n_pressures()];
    let fields = Fields::new(&u, Pressure::Nodal(&p));
    let error_of = |solid: &Solid| {
        let mut force = vec![0.0; u.len()];
        let mut out = Vectors { force: Some(&mut force), ..Vectors::default() };
        solid.evaluate(&fields, &mut out).unwrap_err()
    };
    let (alone, shared) = (error_of(&whole), error_of(&together));
    assert!(error_of(&whole.clone().share(RANKS - 1, RANKS)) == shared);
    assert_eq!((alone.element, alone.barycentric), (shared.element, shared.barycentric));
    let _: Barycentric = shared.barycentric;
}
