//! A further input of a tracked model: `A u = (B/F) q^-nk e + (B_r/F_r) q^-nk_r r + (C/D) eps` (L. Ljung, *System
//! Identification*, 1999, section 4.2, eq. 4.35).
//!
//! A person who sees the target r responds to the error and to r. With one input, a recursion attributes both responses
//! to the error. In theta the coefficients of B_r and F_r follow those of the model of e. The response to r is
//! `B_r z^-nk_r/(A F_r)`; its covariance follows from a part of the covariance of theta.

use std::fmt;

use hoid_ident::{
    SearchOptions,
    family::ChannelRole,
    several_inputs::{InputOrders, SeveralInputs},
};
use hoid_model::{Orders, SampleTime, Structure, uncertainty::Estimate};

use crate::{response::Response, shared_options::DEFAULT_DELAY_S};

/// Frequencies in rad/s at which the response to a further input is compared, and reported if no others are requested.
pub const FURTHER_RESPONSES_RAD_S: [f64; 3] = [1.0, 2.0, 4.0];

/// A requested further input, before the sample time is known.
#[derive(Debug, Clone, PartialEq)]
pub struct RequestedInput {
    /// Name of the channel.
    pub channel: String,
    /// Its role in the task of the person.
    pub role: ChannelRole,
    /// Time by which the person sees the channel ahead, s.
    pub preview_s: f64,
    /// Numbers of coefficients of B and F.
    pub coefficients: [usize; 2],
    /// Delay in samples; `None` for the default delay of people.
    pub nk: Option<usize>,
}

impl RequestedInput {
    /// Returns the input for a sample time.
    pub fn tracked(&self, sample_time: SampleTime) -> TrackedInput {
        let [nb, nf] = self.coefficients;
        TrackedInput {
            channel: self.channel.clone(),
            role: self.role,
            preview_s: self.preview_s,
            orders: InputOrders {
                nb,
                nf,
                nk: self.nk.unwrap_or_else(|| sample_time.nk(DEFAULT_DELAY_S)),
            },
        }
    }
}

/// Response to a further input, in the parameters of an operator with the neuromuscular system of the operator of e.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FurtherOperator {
    /// Gain.
    pub k_f: Estimate,
    /// Gain of the rate of the input, s.
    pub k_f_dot: Estimate,
    /// Delay relative to the input as recorded (in s); negative for a person who uses a preview.
    pub tau_f_s: Estimate,
}

impl FurtherOperator {
    /// Names of the parameters.
    pub const NAMES: [&'static str; 3] = ["K_f", "K_f_dot", "tau_f"];

    /// Returns the parameters, in the order of their names.
    pub fn parameters(&self) -> [Estimate; 3] {
        [self.k_f, self.k_f_dot, self.tau_f_s]
    }
}

/// A further input of a tracked model.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedInput {
    /// Name of the channel.
    pub channel: String,
    /// Its role in the task of the person.
    pub role: ChannelRole,
    /// Time by which the person sees the channel ahead (in s): the model has the channel advanced by this time as its
    /// input.
    pub preview_s: f64,
    /// Numbers of coefficients of B and F, and the delay in samples.
    pub orders: InputOrders,
}

impl fmt::Display for TrackedInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let InputOrders { nb, nf, nk } = self.orders;
        write!(f, "{} ({}), nb={nb}, nf={nf}, nk={nk}", self.channel, self.role)?;
        match self.preview_s > 0.0 {
            true => write!(f, ", preview {} s", self.preview_s),
            false => Ok(()),
        }
    }
}

impl TrackedInput {
    /// Returns the preview in samples.
    pub(crate) fn preview_samples(&self, sample_time: SampleTime) -> usize {
        (self.preview_s / sample_time.s()).round() as usize
    }

    /// Returns the number of coefficients.
    pub fn parameter_count(&self) -> usize {
        self.orders.nb + self.orders.nf
    }

    /// Returns the names of the coefficients, such as `b0[r]`.
    pub fn names(&self) -> Vec<String> {
        let of_b = (0..self.orders.nb).map(|i| format!("b{i}[{}]", self.channel));
        let of_f = (1..=self.orders.nf).map(|i| format!("f{i}[{}]", self.channel));
        of_b.chain(of_f).collect()
    }

    /// Returns the batch model whose fit starts the recursion, with the coefficients in the same order.
    pub(crate) fn batch_model(&self, structure: Structure, orders: &Orders, search: SearchOptions) -> SeveralInputs {
        let first = InputOrders {
            nb: orders.nb,
            nf: orders.nf,
            nk: orders.nk,
        };
        SeveralInputs {
            na: orders.na,
            nc: orders.nc,
            nd: orders.nd,
            // The first input of a batch model is the input of the record; its name only labels coefficients.
            inputs: vec![(String::new(), first), (self.channel.clone(), self.orders)],
            search,
            ..SeveralInputs::new(structure)
        }
    }

    /// Returns the response to this input at a frequency in rad/s; `orders` are the orders of the model of e, and
    /// `covariance` is the covariance of the whole theta by rows.
    pub(crate) fn response(
        &self,
        orders: &Orders,
        theta: &[f64],
        covariance: Option<&[f64]>,
        omega_rad_s: f64,
        sample_time: SampleTime,
    ) -> Response {
        let own = Orders {
            na: orders.na,
            nb: self.orders.nb,
            nc: 0,
            nd: 0,
            nf: self.orders.nf,
            nk: self.orders.nk,
        };
        let first = orders.parameter_count();
        let places: Vec<usize> = (0..orders.na).chain(first..first + self.parameter_count()).collect();
        let theta_of_input: Vec<f64> = places.iter().map(|&i| theta[i]).collect();
        let block = covariance.map(|c| submatrix(c, theta.len(), &places));
        Response::from_polynomials(&own, &theta_of_input, block.as_deref(), omega_rad_s, sample_time)
    }
}

/// Returns the names of the coefficients of a model with these orders of the first input, in the order of theta.
pub(crate) fn coefficient_names(orders: &Orders, further: Option<&TrackedInput>) -> Vec<String> {
    let mut names = orders.parameter_names();
    names.extend(further.into_iter().flat_map(TrackedInput::names));
    names
}

/// Returns the rows and columns at `places` of a matrix of `width` rows.
pub(crate) fn submatrix(matrix: &[f64], width: usize, places: &[usize]) -> Vec<f64> {
    let rows = places.iter().flat_map(|i| places.iter().map(move |j| i * width + j));
    rows.map(|place| matrix[place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn further_input_response_matches_a_separate_model() {
        let orders = Orders {
            na: 1,
            nb: 2,
            nc: 1,
            nd: 1,
            nf: 1,
            nk: 3,
        };
        let input = TrackedInput {
            channel: "r".to_owned(),
            role: ChannelRole::Feedforward,
            preview_s: 0.0,
            orders: InputOrders { nb: 2, nf: 1, nk: 5 },
        };
        assert_eq!(input.names(), ["b0[r]", "b1[r]", "f1[r]"]);
        // [a1, b0, b1, c1, d1, f1], [b0, b1, f1].
        let theta = [-0.4, 0.3, 0.1, 0.2, -0.6, -0.5, 0.7, -0.2, -0.3];
        let p = theta.len();
        let covariance: Vec<f64> = (0..p * p)
            .map(|k| {
                if k / p == k % p {
                    1e-3 * (1 + k / p) as f64
                } else {
                    1e-5
                }
            })
            .collect();
        let found = input.response(&orders, &theta, Some(&covariance), 3.0, SampleTime::AT_100_HZ);
        let alone = Orders {
            na: 1,
            nb: 2,
            nc: 0,
            nd: 0,
            nf: 1,
            nk: 5,
        };
        let places = [0, 6, 7, 8];
        let own = places.map(|i| theta[i]);
        let of_own: Vec<f64> = places
            .iter()
            .flat_map(|i| places.map(|j| covariance[i * p + j]))
            .collect();
        let expected = Response::from_polynomials(&alone, &own, Some(&of_own), 3.0, SampleTime::AT_100_HZ);
        assert_eq!(found, expected);
        let e = Response::from_polynomials(&orders, &theta[..6], None, 3.0, SampleTime::AT_100_HZ);
        assert_ne!(found.value, e.value);
    }
}
