//! Polynomials with two inputs compared with NumPy (`fixtures/several_inputs/make.py`).
#![allow(clippy::unwrap_used)]

use hoid_ident::several_inputs::{InputOrders, SeveralInputs};
use hoid_model::{Channel, Record, SampleTime, Structure};

/// Name, value and standard error.
const NUMPY_ESTIMATES: [(&str, f64, f64); 7] = [
    ("a1", -1.283545131175736e+00, 2.422658995823053e-02),
    ("a2", 4.54561506267509e-01, 1.696994142512972e-02),
    ("b0[e]", 4.921553345453263e-01, 5.373048738401978e-03),
    ("b1[e]", -2.463433290367814e-01, 1.364040276588487e-02),
    ("b0[r]", 2.889891434751112e-01, 5.902828925474547e-03),
    ("b1[r]", 6.079761576196156e-02, 1.071641500412302e-02),
    ("b2[r]", -2.837021338580403e-01, 1.015635533020685e-02),
];
const NUMPY_LOSS: f64 = 0.005733385405958988;

fn record() -> Record {
    let n = 500;
    let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..n).map(|t| f(t as f64)).collect() };
    let e = of(&|t| (0.3 * t).sin() + 0.7 * (0.013 * t * t).cos());
    let r = of(&|t| (0.9 * t + 0.002 * t * t).sin());
    let noise = of(&|t| 0.1 * (0.37 * t * t + 1.0).sin());
    let mut u = vec![0.0; n];
    for k in 5..n {
        u[k] = 1.2 * u[k - 1] - 0.4 * u[k - 2] + 0.5 * e[k - 3] - 0.2 * e[k - 4];
        u[k] += 0.3 * r[k - 1] + 0.1 * r[k - 2] - 0.25 * r[k - 3] + noise[k] + 0.3;
    }
    Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "", e),
        Channel::new("u", "", u),
    )
    .unwrap()
    .with_channel(Channel::new("r", "", r))
    .unwrap()
}

#[test]
fn arx_with_two_inputs_matches_numpy() {
    let model = SeveralInputs {
        na: 2,
        inputs: vec![
            ("e".to_owned(), InputOrders { nb: 2, nf: 0, nk: 3 }),
            ("r".to_owned(), InputOrders { nb: 3, nf: 0, nk: 1 }),
        ],
        ..SeveralInputs::new(Structure::Arx)
    };
    let fit = model.fit(&[record()]).unwrap();
    assert!((fit.loss / NUMPY_LOSS - 1.0).abs() < 1e-10, "{}", fit.loss);
    for ((name, estimate), (expected, value, error)) in fit.parameters().iter().zip(NUMPY_ESTIMATES) {
        assert_eq!(name, expected);
        assert!(
            (estimate.value - value).abs() < 1e-10,
            "{name}: {} {value}",
            estimate.value
        );
        let own = estimate.standard_error.unwrap();
        assert!((own / error - 1.0).abs() < 1e-8, "{name}: {own} {error}");
    }
}
