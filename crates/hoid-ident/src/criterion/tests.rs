use hoid_model::Orders;

use super::{
    Criterion, Data, InitialState, Workspace, first_residual,
    further_input::{FurtherInput, InputOrders},
    initial_state_responses::{InitialHistory, InitialStateResponses},
    polynomials::{Block, Polynomials},
    signals::EliminatedStates,
};
use crate::{
    linalg::vectors::dot,
    optimize::{Linearisation, Objective},
};

/// Returns a record with coloured noise that does not start from rest.
fn record(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut state = 12345_u64;
    let mut noise = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let e: Vec<f64> = (0..n)
        .map(|t| (0.05 * t as f64 + 1.0).sin() + 0.4 * (0.31 * t as f64).cos() + 0.3 * noise())
        .collect();
    let mut u = vec![0.3, 0.2, -0.1];
    let mut colour = 0.0;
    for t in 3..n {
        colour = 0.8 * colour + 0.05 * noise();
        let w = 1.6 * u[t - 1] - 0.7 * u[t - 2] + 0.2 * e[t - 3];
        u.push(w + colour - 0.8 * 0.05 * noise());
    }
    (e, u)
}

fn cases() -> Vec<(Orders, Vec<f64>)> {
    let base = Orders {
        nb: 2,
        nk: 3,
        ..Orders::default()
    };
    vec![
        (Orders { nd: 1, nf: 2, ..base }, vec![0.2, -0.1, -0.5, -1.5, 0.62]),
        (
            Orders { nd: 4, nf: 2, ..base },
            vec![0.2, -0.1, -0.5, 0.2, -0.1, 0.05, -1.5, 0.62],
        ),
        (
            Orders {
                nc: 2,
                nd: 1,
                nf: 2,
                ..base
            },
            vec![0.2, -0.1, 0.3, 0.1, -0.5, -1.5, 0.62],
        ),
        (
            Orders { nc: 1, nf: 3, ..base },
            vec![0.2, -0.1, -0.6, -1.5, 0.62, -0.05],
        ),
        (Orders { na: 2, ..base }, vec![-1.5, 0.6, 0.2, -0.1]),
        (
            Orders {
                na: 1,
                nc: 1,
                nd: 1,
                nf: 1,
                ..base
            },
            vec![-0.6, 0.2, -0.1, 0.4, -0.3, -0.8],
        ),
        (
            Orders {
                nb: 1,
                nk: 0,
                nf: 1,
                nd: 2,
                ..Orders::default()
            },
            vec![0.3, -0.4, 0.1, -0.9],
        ),
        (
            Orders {
                na: 2,
                nc: 1,
                ..Orders::default()
            },
            vec![-1.5, 0.6, 0.4],
        ),
        (
            Orders {
                nc: 2,
                ..Orders::default()
            },
            vec![0.5, 0.2],
        ),
    ]
}

fn criterion<'a>(orders: Orders, data: Vec<Data<'a>>, initial: InitialState) -> Criterion<'a> {
    Criterion {
        first: first_residual(&orders, initial),
        orders,
        data,
        initial,
        weights: None,
        further: Vec::new(),
    }
}

#[test]
fn gradient_matches_finite_differences() {
    let (e, u) = record(300);
    for initial in [InitialState::Zero, InitialState::Estimate, InitialState::Backcast] {
        for ((orders, theta), level) in cases()
            .into_iter()
            .flat_map(|case| [(case.clone(), false), (case, true)])
        {
            let both = [Data::new(&e, &u), Data::new(&e[40..170], &u[40..170])];
            let data = both.map(|data| Data { level, ..data }).to_vec();
            let c = criterion(orders, data, initial);
            let mut ws = Workspace::default();
            let exact = c.linearise(&theta, &mut ws);
            assert!((exact.sum_of_squares - c.sum_of_squares(&theta, &mut ws)).abs() < 1e-10);
            for i in 0..theta.len() {
                let h = 1e-5;
                let mut at = |delta: f64| {
                    let mut shifted = theta.clone();
                    shifted[i] += delta;
                    c.sum_of_squares(&shifted, &mut ws)
                };
                // The fourth-order difference has a truncation error of order h^4 and a rounding error of 1e-9 V (eps
                // V/h).
                let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                let ours = -2.0 * exact.descent[i];
                let scale = exact.gram[i * theta.len() + i].sqrt() * exact.sum_of_squares.sqrt();
                assert!(
                    (slope - ours).abs() < 1e-7 * scale,
                    "{initial:?} {orders} level {level} {}: {ours} and {slope}",
                    orders.parameter_names()[i]
                );
            }
        }
    }
}

#[test]
fn residuals_satisfy_the_model_equation() {
    let (e, u) = record(120);
    let theta = vec![0.2, -0.1, 0.3, -0.5, -1.5, 0.62];
    let orders = Orders {
        nb: 2,
        nc: 1,
        nd: 1,
        nf: 2,
        nk: 3,
        ..Orders::default()
    };
    let c = criterion(orders, vec![Data::new(&e, &u)], InitialState::Zero);
    let eps = c.residuals_of(&theta, 0, &mut Workspace::default());
    // The reference is computed by the recursions, sample by sample, with zeros before the record.
    let get = |x: &[f64], t: usize, lag: usize| if t >= lag { x[t - lag] } else { 0.0 };
    let (mut w, mut v, mut r) = (vec![], vec![], vec![]);
    for t in 0..u.len() {
        let wt = 0.2 * get(&e, t, 3) - 0.1 * get(&e, t, 4) + 1.5 * get(&w, t, 1) - 0.62 * get(&w, t, 2);
        w.push(wt);
        v.push(u[t] - wt);
        r.push(v[t] - 0.5 * get(&v, t, 1) - 0.3 * get(&r, t, 1));
        assert!((r[t] - eps[t]).abs() < 1e-12);
    }
}

#[test]
fn residuals_are_orthogonal_to_the_free_responses() {
    // Shifting w by any free response must not lower the loss: the residual is orthogonal to the
    // basis.
    let (e, u) = record(300);
    for ((orders, theta), level) in cases()
        .into_iter()
        .flat_map(|case| [(case.clone(), false), (case, true)])
    {
        let data = Data {
            level,
            ..Data::new(&e, &u)
        };
        let c = criterion(orders, vec![data], InitialState::Estimate);
        let eps = c.residuals_of(&theta, 0, &mut Workspace::default());
        let parts = Polynomials::split(&orders, &theta);
        let past = InitialHistory {
            c: parts.c,
            d: parts.d,
            f: &[parts.f],
            lead: orders.nd,
            noise: None,
            weights: None,
            level,
        };
        let free = InitialStateResponses::of(&past, eps.len());
        assert_eq!(
            (free.basis().count(), c.state_count()),
            (c.state_count(), orders.nf + orders.nc + usize::from(level))
        );
        for q in free.basis() {
            assert!(dot(q, &eps[..q.len()]).abs() < 1e-12);
        }
    }
}

/// The responses to the initial states are computed once for records of the same length.
#[test]
fn shared_responses_change_no_digit() {
    let (first, second) = (record(400), record(500));
    let records = [
        (&first.0[..], &first.1[..], true),
        (&first.0[..], &second.1[..400], true),
        (&second.0[..], &second.1[..], true),
        (&second.0[..], &second.1[..], false),
        (&first.0[..], &first.1[..], false),
    ];
    for (orders, theta) in cases() {
        let mut shared = Workspace::default();
        for theta in [theta.clone(), theta.iter().map(|x| 0.9 * x).collect()] {
            for (e, u, level) in records {
                let data = Data { e, u, level };
                let c = criterion(orders, vec![data], InitialState::Estimate);
                let [again, alone] = [&mut shared, &mut Workspace::default()].map(|ws| c.linearise(&theta, ws));
                assert_eq!(again.sum_of_squares.to_bits(), alone.sum_of_squares.to_bits());
                assert_eq!((again.descent, again.gram), (alone.descent, alone.gram));
            }
        }
    }
}

#[test]
fn estimated_states_of_a_noise_free_record_are_exact() {
    // The record is cut out of a longer one, so its past is unknown; the residuals are still zero.
    let (e, _) = record(400);
    let mut u = vec![0.5, -0.3, 0.1, 0.2];
    for t in 4..400 {
        u.push(1.6 * u[t - 1] - 0.7 * u[t - 2] + 0.2 * e[t - 3] - 0.12 * e[t - 4]);
    }
    let theta = vec![0.2, -0.12, -0.4, -1.6, 0.7];
    let orders = Orders {
        nb: 2,
        nd: 1,
        nf: 2,
        nk: 3,
        ..Orders::default()
    };
    let data = Data::new(&e[100..], &u[100..]);
    let c = criterion(orders, vec![data], InitialState::Estimate);
    assert!(
        c.residuals_of(&theta, 0, &mut Workspace::default())
            .iter()
            .all(|v| v.abs() < 1e-13)
    );
    let zero = criterion(orders, vec![data], InitialState::Zero);
    assert!(
        zero.residuals_of(&theta, 0, &mut Workspace::default())
            .iter()
            .any(|v| v.abs() > 1e-2)
    );
    // The residuals are also zero if u has a level.
    let lifted: Vec<f64> = u[100..].iter().map(|u| u + 3.0).collect();
    let left = |level: bool| {
        let data = Data {
            level,
            ..Data::new(&e[100..], &lifted)
        };
        let residuals =
            criterion(orders, vec![data], InitialState::Estimate).residuals_of(&theta, 0, &mut Workspace::default());
        residuals.iter().fold(0.0_f64, |most, v| most.max(v.abs()))
    };
    assert!(
        left(true) < 1e-12 && left(false) > 0.1,
        "{} {}",
        left(true),
        left(false)
    );
}

#[test]
fn backcast_sum_of_squares_matches_the_covariance_matrix() {
    let (_, u) = record(60);
    let orders = Orders {
        na: 2,
        nc: 1,
        ..Orders::default()
    };
    let theta = vec![-1.5, 0.7, 0.4];
    let c = criterion(orders, vec![Data::new(&[], &u)], InitialState::Backcast);
    let ours = c.linearise(&theta, &mut Workspace::default()).sum_of_squares;
    // Autocovariance of C/A eps from its impulse response; the poles have modulus 0.84, and 0.84^400 = 1e-30.
    let mut h = vec![1.0, 0.4 + 1.5];
    for t in 2..800 {
        h.push(1.5 * h[t - 1] - 0.7 * h[t - 2]);
    }
    let r: Vec<f64> = (0..60).map(|k| dot(&h[k..], &h[..800 - k])).collect();
    let sigma = nalgebra::DMatrix::from_fn(60, 60, |i, j| r[i.abs_diff(j)]);
    let v = nalgebra::DVector::from_column_slice(&u);
    let exact = v.dot(&sigma.cholesky().unwrap().solve(&v));
    assert!((ours - exact).abs() < 1e-11 * exact, "{ours} {exact}");
}

#[test]
fn gradient_of_the_weighted_criterion_is_exact() {
    let (e, u) = record(200);
    for initial in [InitialState::Zero, InitialState::Estimate, InitialState::Backcast] {
        for (orders, theta) in cases().into_iter().take(4) {
            let plain = criterion(orders, vec![Data::new(&e, &u)], initial);
            let weights = vec![
                (plain.first..200)
                    .map(|t| if t % 7 == 0 { 0.3 } else { 1.0 })
                    .collect::<Vec<f64>>(),
            ];
            let weighted = Criterion {
                weights: Some(&weights),
                ..plain.clone()
            };
            let mut ws = Workspace::default();
            let exact = weighted.linearise(&theta, &mut ws);
            let eps = weighted.residuals_of(&theta, 0, &mut ws);
            let by_hand: f64 = eps.iter().zip(&weights[0]).map(|(e, w)| (e * w) * (e * w)).sum();
            if initial != InitialState::Backcast {
                assert!((by_hand - exact.sum_of_squares).abs() < 1e-12 * by_hand);
            }
            for i in 0..theta.len() {
                let h = 1e-5;
                let mut at = |delta: f64| {
                    let mut shifted = theta.clone();
                    shifted[i] += delta;
                    weighted.sum_of_squares(&shifted, &mut ws)
                };
                let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                let scale = exact.gram[i * theta.len() + i].sqrt() * exact.sum_of_squares.sqrt();
                assert!(
                    (slope + 2.0 * exact.descent[i]).abs() < 1e-7 * scale,
                    "{initial:?} {orders}"
                );
            }
        }
    }
}

#[test]
fn gradient_is_exact_with_a_later_first_residual() {
    let (e, u) = record(300);
    let (orders, theta) = cases().remove(1);
    let data = vec![Data::new(&e, &u)];
    let late = Criterion {
        first: 40,
        ..criterion(orders, data, InitialState::Estimate)
    };
    assert_eq!(late.residual_count(), 260);
    let mut ws = Workspace::default();
    let exact = late.linearise(&theta, &mut ws);
    let h = 1e-5;
    let mut at = |delta: f64| {
        let mut shifted = theta.clone();
        shifted[7] += delta;
        late.sum_of_squares(&shifted, &mut ws)
    };
    let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    assert!((slope + 2.0 * exact.descent[7]).abs() < 1e-6 * slope.abs());
}

/// Adds the first record with a head of this length; `None` if the record must be processed as a whole.
fn add_in_spans(
    c: &Criterion<'_>,
    theta: &[f64],
    blocks: &[Block],
    head: usize,
    ws: &mut Workspace,
    total: &mut Linearisation,
) -> Option<EliminatedStates> {
    let parts = Polynomials::split(&c.orders, theta);
    c.process_in_spans(theta, blocks, 0, head, ws, &mut |states, counted, ws| {
        let columns = c.columns(&parts, counted.clone(), ws, blocks);
        c.accumulate(states, &columns, 0, &ws.eps[counted], total);
    })
}

#[test]
fn sums_over_spans_equal_sums_over_the_record() {
    // After each of these heads the rest consists of whole spans and a part of a span.
    let (e, u) = record(9001);
    let long = Data::new(&e, &u);
    let head = 4096;
    for initial in [InitialState::Zero, InitialState::Estimate] {
        for (orders, theta) in cases() {
            let c = criterion(orders, vec![long], initial);
            let one_by_one = [Block::A, Block::B, Block::C, Block::D, Block::F].map(|block| vec![block]);
            let sets = one_by_one
                .into_iter()
                .chain([Block::ALL.to_vec(), vec![Block::A, Block::B]]);
            for blocks in sets {
                let p: usize = blocks.iter().map(|block| block.range(&orders).len()).sum();
                let nothing = Linearisation {
                    sum_of_squares: 0.0,
                    descent: vec![0.0; p],
                    gram: vec![0.0; p * p],
                };
                let (mut whole, mut spans) = (nothing.clone(), nothing);
                let mut ws = Workspace::default();
                c.add_record(&theta, &blocks, 0, &mut ws, &mut whole);
                let states = add_in_spans(&c, &theta, &blocks, head, &mut ws, &mut spans);
                assert!(states.is_some(), "{initial:?} {orders}");
                assert!((whole.sum_of_squares - spans.sum_of_squares).abs() < 1e-12 * whole.sum_of_squares);
                let mut residuals = Vec::new();
                c.process_in_spans(&theta, &[], 0, head, &mut ws, &mut |_, counted, ws| {
                    residuals.extend_from_slice(&ws.eps[counted]);
                })
                .unwrap();
                assert_eq!(residuals.len(), c.residual_count());
                for (a, b) in residuals.iter().zip(c.residuals_of(&theta, 0, &mut ws)) {
                    assert!((a - b).abs() < 1e-12, "{initial:?} {orders}: {a} and {b}");
                }
                // The error of each product is relative to the largest value that the product can have.
                let size = |i: usize| whole.gram[i * p + i].sqrt();
                for i in 0..p {
                    let scale = size(i) * whole.sum_of_squares.sqrt();
                    assert!(
                        (whole.descent[i] - spans.descent[i]).abs() < 1e-12 * scale,
                        "{initial:?} {orders} {blocks:?}: {} and {}",
                        whole.descent[i],
                        spans.descent[i]
                    );
                    for j in 0..p {
                        let off = whole.gram[i * p + j] - spans.gram[i * p + j];
                        assert!(off.abs() < 1e-12 * size(i) * size(j), "{initial:?} {orders} {blocks:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn spans_are_not_used_with_slow_poles_long_delays_or_weights() {
    let (e, u) = record(9001);
    let data = vec![Data::new(&e, &u)];
    let orders = Orders {
        nb: 1,
        nk: 2,
        nf: 1,
        ..Orders::default()
    };
    let by_spans = |c: &Criterion<'_>, pole: f64, head: usize| {
        let mut total = Linearisation {
            sum_of_squares: 0.0,
            descent: vec![0.0; 2],
            gram: vec![0.0; 4],
        };
        let (theta, mut ws) = (vec![0.2, -pole], Workspace::default());
        let states = add_in_spans(c, &theta, &Block::ALL, head, &mut ws, &mut total);
        assert_eq!(
            states.is_some(),
            total.sum_of_squares > 0.0,
            "nothing is added where nothing passes"
        );
        states.is_some()
    };
    let c = criterion(orders, data.clone(), InitialState::Estimate);
    assert!(by_spans(&c, 0.99, 4096));
    assert!(!by_spans(&c, 0.9999, 4096), "a slow pole");
    assert!(!by_spans(&c, 0.99, 8192), "a record of less than two heads");
    let late = Orders { nk: 1500, ..orders };
    assert!(!by_spans(
        &criterion(late, data.clone(), InitialState::Estimate),
        0.9,
        4096
    ));
    assert!(!by_spans(
        &criterion(orders, data.clone(), InitialState::Backcast),
        0.9,
        4096
    ));
    let weights = vec![vec![1.0; u.len()]];
    let weighted = Criterion {
        weights: Some(&weights),
        ..c
    };
    assert!(!by_spans(&weighted, 0.9, 4096));
}

/// Returns two different inputs and an output.
fn inputs(n: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (e, u) = record(n);
    let x = (0..n)
        .map(|t| (0.11 * t as f64).sin() - 0.5 * (0.47 * t as f64 + 0.3).cos() + 0.2 * e[(7 * t + 3) % n])
        .collect();
    (e, x, u)
}

fn with_further<'a>(
    orders: Orders,
    further: Vec<FurtherInput<'a>>,
    data: Vec<Data<'a>>,
    initial: InitialState,
) -> Criterion<'a> {
    let late = further.iter().map(|f| f.orders.first_regressed_sample()).max();
    let first = match initial {
        InitialState::Zero => 0,
        _ => late.unwrap_or(0).max(orders.first_regressed_sample()) + orders.nd,
    };
    Criterion {
        first,
        further,
        ..criterion(orders, data, initial)
    }
}

#[test]
fn single_further_input_equals_the_first_input() {
    let (e, u) = record(300);
    let alone = Orders {
        nb: 2,
        nc: 1,
        nd: 2,
        nf: 2,
        nk: 3,
        ..Orders::default()
    };
    let none = Orders {
        nb: 0,
        nf: 0,
        nk: 0,
        ..alone
    };
    // The order b, c, d, f becomes c, d, b, f.
    let theta = [0.2, -0.1, 0.3, -0.5, 0.1, -1.5, 0.62];
    let order = [2, 3, 4, 0, 1, 5, 6];
    let moved: Vec<f64> = order.iter().map(|&i| theta[i]).collect();
    for initial in [InitialState::Zero, InitialState::Estimate] {
        let further = FurtherInput {
            orders: InputOrders { nb: 2, nf: 2, nk: 3 },
            values: vec![&e],
        };
        let mut ws = Workspace::default();
        let one = criterion(alone, vec![Data::new(&e, &u)], initial).linearise(&theta, &mut ws);
        let other = with_further(none, vec![further], vec![Data::new(&e, &u)], initial);
        let two = other.linearise(&moved, &mut ws);
        assert!((one.sum_of_squares / two.sum_of_squares - 1.0).abs() < 1e-13);
        for (i, &a) in order.iter().enumerate() {
            assert!((one.descent[a] - two.descent[i]).abs() < 1e-10, "{initial:?} {i}");
            for (j, &b) in order.iter().enumerate() {
                let (x, y) = (one.gram[a * 7 + b], two.gram[i * 7 + j]);
                assert!((x - y).abs() < 1e-10 * (1.0 + x.abs()), "{initial:?} {i} {j}");
            }
        }
    }
}

#[test]
fn gradient_with_two_inputs_matches_finite_differences() {
    let (e, x, u) = inputs(300);
    let base = Orders {
        nb: 2,
        nk: 3,
        ..Orders::default()
    };
    let bj = (
        Orders {
            nc: 1,
            nd: 2,
            nf: 2,
            ..base
        },
        2,
        vec![0.2, -0.1, 0.3, -0.5, 0.1, -1.5, 0.62],
    );
    let arx = (Orders { na: 2, ..base }, 0, vec![-1.5, 0.6, 0.2, -0.1]);
    let armax = (Orders { na: 2, nc: 1, ..base }, 1, vec![-1.5, 0.6, 0.2, -0.1, 0.3]);
    for initial in [InitialState::Zero, InitialState::Estimate] {
        for (orders, nf, own) in [&bj, &arx, &armax] {
            let mut theta = own.clone();
            theta.extend([0.15, -0.05, 0.03]);
            theta.extend(&[-0.8, 0.1][..*nf]);
            let further = FurtherInput {
                orders: InputOrders { nb: 3, nf: *nf, nk: 7 },
                values: vec![&x, &x[40..170]],
            };
            let both = [Data::new(&e, &u), Data::new(&e[40..170], &u[40..170])];
            let data = both.map(|data| Data { level: true, ..data }).to_vec();
            let c = with_further(*orders, vec![further], data, initial);
            let mut ws = Workspace::default();
            let exact = c.linearise(&theta, &mut ws);
            for i in 0..theta.len() {
                let h = 1e-5;
                let mut at = |delta: f64| {
                    let mut shifted = theta.clone();
                    shifted[i] += delta;
                    c.sum_of_squares(&shifted, &mut ws)
                };
                let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                let ours = -2.0 * exact.descent[i];
                let scale = exact.gram[i * theta.len() + i].sqrt() * exact.sum_of_squares.sqrt();
                assert!(
                    (slope - ours).abs() < 1e-7 * scale,
                    "{initial:?} {orders} {i}: {ours} and {slope}"
                );
            }
        }
    }
}

#[test]
fn residuals_of_noise_free_two_input_data_are_zero() {
    let (e, x, _) = inputs(400);
    let (mut one, mut two) = (vec![0.5, -0.3, 0.1, 0.2, 0.1, 0.3], vec![0.2; 6]);
    for t in 6..400 {
        one.push(1.6 * one[t - 1] - 0.7 * one[t - 2] + 0.2 * e[t - 3] - 0.12 * e[t - 4]);
        two.push(0.9 * two[t - 1] + 0.3 * x[t - 6]);
    }
    let u: Vec<f64> = one.iter().zip(&two).map(|(a, b)| a + b + 2.0).collect();
    let orders = Orders {
        nb: 2,
        nd: 1,
        nf: 2,
        nk: 3,
        ..Orders::default()
    };
    let further = FurtherInput {
        orders: InputOrders { nb: 1, nf: 1, nk: 6 },
        values: vec![&x[100..]],
    };
    let data = Data {
        level: true,
        ..Data::new(&e[100..], &u[100..])
    };
    let c = with_further(orders, vec![further], vec![data], InitialState::Estimate);
    let theta = [0.2, -0.12, -0.4, -1.6, 0.7, 0.3, -0.9];
    let eps = c.residuals_of(&theta, 0, &mut Workspace::default());
    assert!(eps.iter().all(|v| v.abs() < 1e-12));
    assert_eq!(c.state_count(), 4);
}
