//! The noise model of a start whose operator is known: the polynomial D, fitted to the residual of the operator.
//!
//! `v(t) = u(t) - (B/F) q^-nk e(t)` is an autoregression, `D v = eps`, whose coefficients follow from
//! least squares (L. Ljung, *System Identification*, 1999, section 10.1).

use hoid_ident::{Estimator, Fit};
use hoid_model::{Channel, Orders, Record, Structure};

/// D with its covariance.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StartNoise {
    /// Coefficients of D after the leading 1.
    pub d: Vec<f64>,
    /// Covariance of the coefficients, by rows.
    pub covariance: Vec<f64>,
    /// Variance of the innovations.
    pub variance: f64,
}

impl StartNoise {
    /// Fits D of order nd to the residual of the operator of a fit in a record; `None` if the record is too short or
    /// constant, or if the fit has another sample time.
    pub fn of(fit: &Fit, record: &Record, nd: usize) -> Option<Self> {
        let simulated = fit.simulate(record).ok()?;
        let output = record.output().get(simulated.first..)?;
        let left = output.iter().zip(&simulated.values).map(|(u, w)| u - w).collect();
        let left = Record::from_output(record.sample_time(), Channel::new("v", "", left)).ok()?;
        let orders = Orders {
            na: nd,
            nb: 0,
            nc: 0,
            nd: 0,
            nf: 0,
            nk: 0,
        };
        let found = Estimator::new(Structure::Ar, orders)
            .fit(std::slice::from_ref(&left))
            .ok()?;
        let variance = found.innovation_variance();
        (variance > 0.0).then_some(Self {
            d: found.model().theta().to_vec(),
            covariance: found.covariance()?.to_vec(),
            variance,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, Scenario};
    use hoid_sim::{RunSeed, Simulator};

    use super::*;

    fn span() -> Record {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        simulator
            .run(RunSeed::default(), false)
            .unwrap()
            .span(0.0, 30.0)
            .unwrap()
    }

    #[test]
    fn d_satisfies_the_normal_equations() {
        let span = span();
        let fit = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29))
            .fit(std::slice::from_ref(&span))
            .unwrap();
        let noise = StartNoise::of(&fit, &span, 4).unwrap();
        assert_eq!((noise.d.len(), noise.covariance.len()), (4, 16));
        // Batch computation for comparison: the residuals of D satisfy the normal equations.
        let w = fit.simulate(&span).unwrap();
        let v: Vec<f64> = span.output()[w.first..]
            .iter()
            .zip(&w.values)
            .map(|(u, w)| u - w)
            .collect();
        let eps = |t: usize| v[t] + (0..4).map(|j| noise.d[j] * v[t - 1 - j]).sum::<f64>();
        let n = v.len() as f64;
        for lag in 1..=4 {
            let products: f64 = (4..v.len()).map(|t| eps(t) * v[t - lag]).sum::<f64>() / n;
            let size = (noise.variance * v.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
            assert!(products.abs() < 2e-2 * size, "{lag} {products} {size}");
        }
    }

    #[test]
    fn short_span_gives_no_noise_model() {
        let span = span();
        let fit = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29))
            .fit(std::slice::from_ref(&span))
            .unwrap();
        let short = span.span(0.0, 0.03).unwrap();
        assert!(StartNoise::of(&fit, &short, 6).is_none());
    }
}
