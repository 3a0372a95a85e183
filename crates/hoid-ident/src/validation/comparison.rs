//! Comparison of a model with a record: simulated and predicted output, and tests of the residuals.

use std::fmt;

use hoid_model::{Record, numbers::format_significant, polynomial::product, polynomial_model::monic};

use super::{
    correlation::{Correlation, autocorrelation, centred, cross_correlation},
    goodness_of_fit::{ErrorSums, GoodnessOfFit},
    whiteness::{LjungBox, MAX_LAG, ljung_box},
};
use crate::{Fit, IdentError, Series};

/// Results of the residual tests. By chance one in a hundred lags is outside the 99 % bound; a share above
/// [`MAX_OUTSIDE_SHARE`] is significant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResidualDiagnostics {
    /// The residuals are not white at the 1 % level: the order of the noise model is too low.
    pub coloured_residuals: bool,
    /// The residuals are correlated with the input at nonnegative lags: the model lacks dynamics or has the wrong
    /// delay.
    pub under_modelled: bool,
    /// The input is correlated with earlier residuals (negative lags): the output is fed back to the input, as in every
    /// closed loop.
    pub feedback: bool,
}

/// Share of lags outside the 99 % bound above which a correlation is significant.
pub const MAX_OUTSIDE_SHARE: f64 = 0.06;

/// Simulated and predicted outputs of a model for a record, with the measures and tests derived from them.
#[derive(Debug, Clone, PartialEq)]
pub struct Validation {
    /// Index in the record of the first sample of the simulated and predicted outputs.
    pub first: usize,
    /// Simulated output.
    pub simulated: Vec<f64>,
    /// One-step-ahead prediction.
    pub predicted: Vec<f64>,
    /// VAF and NRMSE.
    pub quality: GoodnessOfFit,
    /// Residual autocorrelation at the lags 1 to [`MAX_LAG`].
    pub autocorrelation: Correlation,
    /// Cross-correlation of residuals and input at the lags from minus to plus [`MAX_LAG`]; empty without an input.
    pub cross_correlation: Correlation,
    /// Whiteness test of the residuals; `None` unless there are more lags than coefficients of the noise model.
    pub ljung_box: Option<LjungBox>,
}

impl Validation {
    /// Returns the results of the residual tests.
    pub fn diagnostics(&self) -> ResidualDiagnostics {
        let outside = |keep: fn(i64) -> bool| {
            let c = &self.cross_correlation;
            let lags = || c.lags.iter().zip(&c.values).filter(|(k, _)| keep(**k));
            let beyond = lags().filter(|(_, r)| r.abs() > c.bound_99).count();
            beyond as f64 > MAX_OUTSIDE_SHARE * lags().count() as f64
        };
        ResidualDiagnostics {
            coloured_residuals: self.ljung_box.is_some_and(|t| t.p_value < 0.01),
            under_modelled: outside(|k| k >= 0),
            feedback: outside(|k| k < 0),
        }
    }
}

impl fmt::Display for Validation {
    /// Formats VAF and NRMSE of simulation and prediction, followed by the results of the residual tests.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let q = &self.quality;
        let found = self.diagnostics();
        writeln!(f, "                       VAF    NRMSE")?;
        writeln!(
            f,
            "simulation         {:5.1} %  {:5.1} %",
            q.vaf_simulation, q.nrmse_simulation
        )?;
        writeln!(
            f,
            "prediction         {:5.1} %  {:5.1} %",
            q.vaf_prediction, q.nrmse_prediction
        )?;
        match self.ljung_box {
            Some(test) => writeln!(
                f,
                "whiteness          Q = {} with {} degrees of freedom, p = {}: residuals {} at the 1 % level",
                format_significant(test.statistic, 3),
                test.degrees_of_freedom,
                format_significant(test.p_value, 2),
                if found.coloured_residuals { "coloured" } else { "white" }
            )?,
            None => writeln!(
                f,
                "whiteness          not tested: no more lags than coefficients of the noise model"
            )?,
        }
        let outside = |from: i64| {
            let c = &self.cross_correlation;
            let lags = c.lags.iter().zip(&c.values).filter(|(k, _)| (**k >= 0) == (from >= 0));
            let beyond = lags.clone().filter(|(_, r)| r.abs() > c.bound_99).count();
            format!("{beyond} of {} lags outside the 99 % bound", lags.count())
        };
        if self.cross_correlation.lags.is_empty() {
            return f.write_str("input              not tested: the record has no input");
        }
        let missed = if found.under_modelled {
            "dynamics are missing"
        } else {
            "no sign of missing dynamics"
        };
        let fed_back = if found.feedback {
            "feedback from the output"
        } else {
            "no sign of feedback"
        };
        writeln!(f, "input, lags >= 0   {}: {missed}", outside(0))?;
        write!(f, "input, lags < 0    {}: {fed_back}", outside(-1))
    }
}

impl Fit {
    /// Compares the model with a record, which may be one of the fitted records or another record.
    ///
    /// # Errors
    /// The errors of [`Fit::residuals`].
    pub fn validate(&self, record: &Record) -> Result<Validation, IdentError> {
        let (first, simulated, predicted) = self.model_outputs(record)?;
        let output = &record.output()[first..];
        let residuals = centred(output.iter().zip(&predicted).map(|(u, p)| u - p).collect());
        let autocorrelation = autocorrelation(&residuals, MAX_LAG);
        let o = self.orders();
        let of_noise = |name: &str| name.starts_with(['a', 'c', 'd']);
        let free = o
            .parameter_names()
            .iter()
            .zip(self.fixed_or_bounded_flags())
            .filter(|(name, held)| of_noise(name) && !**held)
            .count();
        // The noise model of a grey box has a single parameter, T_n.
        let free = if self.is_grey_box() { free.min(1) } else { free };
        Ok(Validation {
            ljung_box: ljung_box(&autocorrelation, residuals.len(), free),
            quality: ErrorSums::default()
                .with_record(output, &simulated, &predicted)
                .quality(),
            autocorrelation,
            cross_correlation: match record.input_channel() {
                Some(input) => cross_correlation(&residuals, &centred(input.values[first..].to_vec()), MAX_LAG),
                None => Correlation {
                    lags: Vec::new(),
                    values: Vec::new(),
                    bound_99: 0.0,
                },
            },
            first,
            simulated,
            predicted,
        })
    }

    /// Returns the first sample contained in both outputs, and the simulated output and the one-step-ahead prediction
    /// from this sample on.
    fn model_outputs(&self, record: &Record) -> Result<(usize, Vec<f64>, Vec<f64>), IdentError> {
        let (simulated, predicted) = (self.simulate(record)?, self.predict(record)?);
        let first = simulated.first.max(predicted.first);
        let from_there = |mut series: Series| {
            series.values.drain(..first - series.first);
            series.values
        };
        Ok((first, from_there(simulated), from_there(predicted)))
    }

    /// Predicts the output k samples ahead for a known input: `u - sum_{j<k} h_j eps(t-j)`, where h is the impulse
    /// response of the noise filter C/(A D) (L. Ljung, *System Identification*, 1999, eq. 3.31). For k = 1 the result
    /// equals [`Fit::predict`]; for large k and a stable noise filter it approaches [`Fit::simulate`].
    ///
    /// # Errors
    /// The errors of [`Fit::residuals`]; [`IdentError::BadOption`] for k = 0.
    pub fn predict_ahead(&self, record: &Record, k: usize) -> Result<Series, IdentError> {
        if k == 0 {
            return Err(IdentError::BadOption {
                option: "the prediction horizon".to_owned(),
                found: "0".to_owned(),
                expected: "one sample or more".to_owned(),
            });
        }
        let eps = self.residuals(record)?;
        let m = self.model();
        let mut h = monic(m.c());
        // Later values of the impulse response have no effect within the record.
        h.resize(k.min(eps.values.len().max(1)), 0.0);
        let poles = product(&monic(m.a()), &monic(m.d()));
        hoid_core::filter::divide_in_place(&poles[1..], &mut h);
        let mut errors = vec![0.0; eps.values.len()];
        hoid_core::filter::fir(&h, 0, &eps.values, &mut errors);
        // For earlier samples not all of the last k residuals are known.
        let skipped = (k - 1).min(errors.len());
        let first = eps.first + skipped;
        let output = &record.output()[first..];
        Ok(Series {
            first,
            values: output.iter().zip(&errors[skipped..]).map(|(u, e)| u - e).collect(),
        })
    }

    /// Returns VAF and NRMSE for several records together: the sum of all squared errors relative to the total power
    /// or, for NRMSE, relative to the total of the squared deviations from the mean of each record.
    ///
    /// # Errors
    /// The errors of [`Fit::residuals`].
    pub fn quality(&self, records: &[Record]) -> Result<GoodnessOfFit, IdentError> {
        let all = records.iter().try_fold(ErrorSums::default(), |all, record| {
            let (first, simulated, predicted) = self.model_outputs(record)?;
            Ok::<_, IdentError>(all.with_record(&record.output()[first..], &simulated, &predicted))
        });
        all.map(|all| all.quality())
    }
}

impl GoodnessOfFit {
    /// Returns the result of [`Fit::quality`] for several records, computed from their existing validations.
    pub fn pooled<'a>(validated: impl Iterator<Item = (&'a Record, &'a Validation)>) -> Self {
        let with = |all: ErrorSums, (record, v): (&'a Record, &'a Validation)| {
            all.with_record(&record.output()[v.first..], &v.simulated, &v.predicted)
        };
        validated.fold(ErrorSums::default(), with).quality()
    }
}
