//! The true values of the estimated quantities, from the columns of a simulated record.

use hoid_model::{OperatorParameters, Record};
use hoid_track::Trace;

use super::coefficients::{Coefficient, trace_coefficients};

/// The true parameters of the operator at sample `k`; `None` unless the record contains all of them.
fn operator(record: &Record, k: usize) -> Option<OperatorParameters> {
    let at = |name| record.channel(name).map(|values| values[k]);
    Some(OperatorParameters {
        k_e: at("K_e")?,
        t_l_s: at("T_L")?,
        omega_nm_rad_s: at("omega_nm")?,
        zeta_nm: at("zeta_nm")?,
        tau_e_s: at("tau_e")?,
    })
}

/// Index of the sample at a time; `None` outside the record.
pub fn sample_index(record: &Record, time_s: f64) -> Option<usize> {
    let k = ((time_s - record.time_s(0)) / record.sample_time().s()).round();
    (k >= 0.0 && k < record.len() as f64).then_some(k as usize)
}

/// The true value of an operator parameter at a time.
pub fn parameter(record: &Record, name: &str, time_s: f64) -> Option<f64> {
    let values = record.channel(name)?;
    sample_index(record, time_s).map(|k| values[k])
}

/// The true coefficients of B and of the poles at every sample, computed by the exact hold with the parameters of that
/// sample. Empty without true values and for a model without the structure of the operator; only B is omitted if the
/// trace tracks the delay or if the true delay differs from that of the model.
pub fn coefficients(record: &Record, trace: &Trace) -> Vec<(Coefficient, Vec<f64>)> {
    let orders = trace.options().orders;
    let is_operator = orders.nb == 2 && (orders.na, orders.nf) != (2, 2) && (orders.na == 2 || orders.nf == 2);
    if !is_operator || operator(record, 0).is_none() {
        return Vec::new();
    }
    let mut before = None;
    let mut held = [f64::NAN; 4];
    let rows: Vec<[f64; 4]> = (0..record.len())
        .map(|k| {
            let now = operator(record, k);
            if now != before {
                before = now;
                held = match now.map(|o| o.discretise(record.sample_time())) {
                    Some(Ok(d)) if d.nk == orders.nk && trace.options().method.track_delay_s().is_none() => {
                        [d.zoh.b0, d.zoh.b1, d.zoh.f1, d.zoh.f2]
                    }
                    Some(Ok(d)) => [f64::NAN, f64::NAN, d.zoh.f1, d.zoh.f2],
                    _ => [f64::NAN; 4],
                };
            }
            held
        })
        .collect();
    let pole = if orders.na == 2 { 'a' } else { 'f' };
    let wanted = [('b', 0), ('b', 1), (pole, 1), (pole, 2)];
    trace_coefficients(trace)
        .into_iter()
        .filter_map(|c| {
            let at = wanted.iter().position(|w| *w == (c.letter, c.index))?;
            let values: Vec<f64> = rows.iter().map(|r| r[at]).collect();
            values.iter().any(|v| v.is_finite()).then_some((c, values))
        })
        .collect()
}
