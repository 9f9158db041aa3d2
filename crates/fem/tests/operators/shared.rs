//! Passes whose elements are shared out, among processes or threads, against those of the whole solid.

use std::sync::{Arc, Mutex};

use myovib_fem::material::{ActiveStress, Law};
use myovib_fem::{
    AddedMotion, AddedStress, AddedTangents, Barycentric, DofMap, Fields, Inverted,
    ParallelAssembler, Pass, Pressure, Solid, Space, Tangents, Vectors, generate,
};

use rayon::ThreadPoolBuilder;

use crate::common::{DENSITY, MUSCLE_LAW, SMALL_LAW, random};

const RANKS: usize = 3;

/// Two laws, one of them with a stress that is added.
fn solid(cells: [usize; 3]) -> Solid {
    let mesh = generate::block([0.0; 3], [1.0, 0.8, 0.6], cells).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let n = mesh.n_elements();
    let laws: Vec<Law> = (0..n)
        .map(|e| if e % 3 == 0 { SMALL_LAW } else { MUSCLE_LAW })
        .collect();
    let stress = AddedStress {
        active: Some(ActiveStress::PLAIN),
        viscosity: 70.0,
    };
    let members = (0..n).filter(|e| e % 3 == 1).collect();
    Solid::new(space, dofs, laws, DENSITY)
        .unwrap()
        .with_added_stresses(&[(members, stress)])
        .unwrap()
}

/// The other shares, in this process; they compute when they are told to begin.
#[derive(Debug)]
struct Others {
    shares: Vec<Solid>,
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
        *self.computed.lock().unwrap() = self.shares.iter().map(compute).collect();
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

fn shared(whole: &Solid) -> Solid {
    let share = |number| whole.clone().share(number, RANKS);
    let others = Others {
        shares: (1..RANKS).map(share).collect(),
        computed: Mutex::default(),
    };
    whole.clone().with_assembler(Arc::new(others), RANKS)
}

/// Sums of a hundred terms in another order: ε for each.
fn assert_same(a: &[f64], b: &[f64]) {
    let largest = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(largest > 0.0, "a result that is there");
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= 100.0 * f64::EPSILON * largest, "{a} {b}");
    }
}

/// Every result of every pass at a state drawn at random.
fn everything(solid: &Solid) -> Vec<Vec<f64>> {
    let (n, m) = (solid.space().n_components(), solid.space().n_pressures());
    let (u, v) = (random(n, 0.01, 1), random(n, 0.3, 2));
    let (p, p_rate, mu) = (random(m, 1e3, 3), random(m, 1e3, 4), random(m, 1.0, 5));
    let fields = Fields {
        v: Some(&v),
        p_rate: Some(&p_rate),
        mu: Some(&mu),
        ..Fields::new(&u, Pressure::Nodal(&p))
    };
    let (square, wide) = (
        solid.displacement_pattern().nnz(),
        solid.divergence_pattern().nnz(),
    );
    let tensions = vec![3e3; solid.n_tensions()];
    let motion = AddedMotion {
        u: &u,
        v: &v,
        tensions: &tensions,
    };
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
    let out = AddedTangents {
        by_displacement: vectors.next(),
        by_velocity: vectors.next(),
    };
    solid.added_tangents(&motion, out);
    drop(vectors);
    results
}

#[test]
fn threads_change_no_bit() {
    // 960 elements: 120 batches, more than are computed before they are added.
    let alone = solid([10, 4, 4]);
    assert_eq!(alone.space().n_elements(), 960);
    let expected = everything(&alone);
    for threads in [1, 2, 3] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let together = alone.clone().in_threads(Some(Arc::new(pool.unwrap())));
        for (number, (a, b)) in expected.iter().zip(everything(&together)).enumerate() {
            let same = a.iter().zip(&b).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same, "result {number} with {threads} threads");
        }
        // Of many elements turned inside out, the first is named.
        let u = random(alone.space().n_components(), 1.0, 6);
        let p = vec![0.0; alone.space().n_pressures()];
        let [first, named] = [&alone, &together].map(|solid| {
            let mut force = vec![0.0; u.len()];
            let mut out = Vectors {
                force: Some(&mut force),
                ..Vectors::default()
            };
            solid
                .evaluate(&Fields::new(&u, Pressure::Nodal(&p)), &mut out)
                .unwrap_err()
        });
        assert_eq!(first, named);
    }
}

#[test]
fn shares_sum_to_the_passes_of_the_whole() {
    let whole = solid([3, 2, 2]);
    let together = shared(&whole);
    let (n, m) = (whole.space().n_components(), whole.space().n_pressures());
    let u = random(n, 0.01, 1);
    for (a, b) in everything(&whole).iter().zip(everything(&together)) {
        assert_same(a, &b);
    }
    // What is not wanted is neither computed nor summed.
    let mut defects = [vec![0.0; m], vec![0.0; m]];
    for (solid, volume_residual) in [&whole, &together].into_iter().zip(&mut defects) {
        let mut out = Vectors {
            volume_residual: Some(volume_residual),
            ..Vectors::default()
        };
        solid
            .evaluate(&Fields::new(&u, Pressure::Penalty { kappa: 1e5 }), &mut out)
            .unwrap();
    }
    assert_same(&defects[0], &defects[1]);
}

#[test]
fn no_element_is_in_two_shares_or_in_none() {
    let whole = solid([3, 2, 2]);
    let weight = |solid: &Solid| {
        let mut force = vec![0.0; whole.space().n_components()];
        let u: Vec<f64> = whole
            .space()
            .coordinates()
            .iter()
            .map(|x| 0.1 * x)
            .collect();
        let mut volume_residual = vec![0.0; whole.space().n_pressures()];
        let mut out = Vectors {
            force: Some(&mut force),
            volume_residual: Some(&mut volume_residual),
            ..Vectors::default()
        };
        solid
            .evaluate(&Fields::new(&u, Pressure::Penalty { kappa: 0.0 }), &mut out)
            .unwrap();
        volume_residual.iter().sum::<f64>()
    };
    let all = weight(&whole);
    for ranks in [1, 2, 5, 100] {
        let shares: Vec<f64> = (0..ranks)
            .map(|k| weight(&whole.clone().share(k, ranks)))
            .collect();
        let sum: f64 = shares.iter().sum();
        assert!(
            (sum - all).abs() <= 1e3 * f64::EPSILON * all.abs(),
            "{ranks}: {sum} {all}"
        );
        let most = shares.iter().fold(0.0_f64, |m, x| m.max(*x));
        assert!(ranks == 1 || most < 0.75 * all, "{ranks}: {most} of {all}");
    }
}

#[test]
fn an_element_turned_inside_out_in_another_share_is_told() {
    let whole = solid([3, 2, 2]);
    let together = shared(&whole);
    // The last corner, pushed through the body, is in elements of the last share.
    let mut u = vec![0.0; whole.space().n_components()];
    let d = whole.space().dimension();
    let far = |x: &[f64]| x.iter().sum::<f64>();
    let corner = whole
        .space()
        .coordinates()
        .chunks(d)
        .map(far)
        .fold(0.0, f64::max);
    for (x, u) in whole.space().coordinates().chunks(d).zip(u.chunks_mut(d)) {
        if far(x) == corner {
            u.fill(-1.0);
        }
    }
    let p = vec![0.0; whole.space().n_pressures()];
    let fields = Fields::new(&u, Pressure::Nodal(&p));
    let of = |solid: &Solid| {
        let mut force = vec![0.0; u.len()];
        let mut out = Vectors {
            force: Some(&mut force),
            ..Vectors::default()
        };
        solid.evaluate(&fields, &mut out).unwrap_err()
    };
    let (alone, shared) = (of(&whole), of(&together));
    assert!(of(&whole.clone().share(RANKS - 1, RANKS)) == shared);
    assert_eq!(
        (alone.element, alone.barycentric),
        (shared.element, shared.barycentric)
    );
    let _: Barycentric = shared.barycentric;
}
