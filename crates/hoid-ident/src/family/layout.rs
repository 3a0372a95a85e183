//! Where the coordinates of an operator and the coefficients of its noise model are in eta.
//!
//! `eta = [coordinates.., c_1 .. c_nc, d_1 .. d_nd]`: those of the operator first, then those of
//! the noise `v = (C/D) eps`. A coordinate that each record has for itself appears once for each of
//! them; the noise is common to all.

use std::ops::Range;

use hoid_model::{
    FamilyOperator, ModelError, Orders, SampleTime,
    delayed_operator::whole_samples,
    operator_family::{Coordinate, Form},
};

use super::intersample::Intersample;
use crate::grey_box::parametrisation::{Mapped, Parametrisation};

/// Places of the parameters of each record.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FamilyLayout {
    pub form: Form,
    pub neuromuscular: bool,
    pub nc: usize,
    pub nd: usize,
    pub sample_time: SampleTime,
    /// Intersample behaviour of the error.
    pub intersample: Intersample,
    /// Place in eta of each slot, for each record.
    positions: Vec<Vec<usize>>,
    limits: Vec<(f64, f64)>,
    /// Coordinate and record of each element of eta before the noise; no record where it is common.
    pub elements: Vec<(Coordinate, Option<usize>)>,
}

impl FamilyLayout {
    pub fn new(
        (form, neuromuscular): (Form, bool),
        (nc, nd): (usize, usize),
        records: usize,
        individual: &[Coordinate],
        bounds: &[(f64, f64)],
        (sample_time, intersample): (SampleTime, Intersample),
    ) -> Self {
        let mut layout = Self {
            form,
            neuromuscular,
            nc,
            nd,
            sample_time,
            intersample,
            positions: vec![Vec::new(); records],
            limits: Vec::new(),
            elements: Vec::new(),
        };
        for (coordinate, bound) in form.coordinates(neuromuscular).into_iter().zip(bounds) {
            let own = records > 1 && individual.contains(&coordinate);
            for record in 0..records {
                if own || record == 0 {
                    layout.elements.push((coordinate, own.then_some(record)));
                    layout.limits.push(*bound);
                }
                layout.positions[record].push(layout.limits.len() - 1);
            }
        }
        for _ in 0..nc + nd {
            layout.limits.push((f64::NEG_INFINITY, f64::INFINITY));
            let place = layout.limits.len() - 1;
            layout.positions.iter_mut().for_each(|p| p.push(place));
        }
        layout
    }

    /// Number of coordinates of one operator.
    pub fn coordinates(&self) -> usize {
        self.form.coordinates(self.neuromuscular).len()
    }

    /// Number of elements of eta that are coordinates.
    pub fn operator_elements(&self) -> usize {
        self.elements.len()
    }

    /// The coordinates of a record.
    pub fn coordinates_of(&self, eta: &[f64], record: usize) -> Vec<f64> {
        let own = &self.positions[record][..self.coordinates()];
        own.iter().map(|&place| eta[place]).collect()
    }

    /// An eta with the same operator for all records.
    pub fn spread(&self, coordinates: &[f64], noise: &[f64]) -> Vec<f64> {
        let all = self.form.coordinates(self.neuromuscular);
        let value = |(coordinate, _): &(Coordinate, Option<usize>)| {
            let index = all.iter().position(|c| c == coordinate).unwrap_or(0);
            coordinates[index]
        };
        self.elements.iter().map(value).chain(noise.iter().copied()).collect()
    }

    /// The operator of a record.
    pub fn operator(&self, eta: &[f64], record: usize) -> Result<FamilyOperator, ModelError> {
        FamilyOperator::new(self.form, self.neuromuscular, &self.coordinates_of(eta, record))
    }

    /// Longest nk that eta can take.
    pub fn longest_nk(&self) -> Result<usize, ModelError> {
        let longest = self.delays().into_iter().map(|i| self.limits[i].1).fold(0.0, f64::max);
        Ok(whole_samples(longest, self.sample_time)? + 1)
    }

    fn order(&self) -> usize {
        usize::from(self.form.has_pole()) + if self.neuromuscular { 2 } else { 0 }
    }
}

impl Parametrisation for FamilyLayout {
    fn positions(&self, record: usize) -> &[usize] {
        &self.positions[record]
    }

    fn limits(&self) -> &[(f64, f64)] {
        &self.limits
    }

    fn delays(&self) -> Vec<usize> {
        let delay = |i: &usize| self.elements[*i].0 == Coordinate::Delay;
        (0..self.elements.len()).filter(delay).collect()
    }

    fn delay_of(&self, record: usize) -> usize {
        self.positions[record][self.coordinates() - 1]
    }

    fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    fn first_sample_begins(&self) -> f64 {
        if self.intersample == Intersample::Auto {
            -0.5
        } else {
            0.0
        }
    }

    fn orders(&self, nk: usize) -> Orders {
        Orders {
            na: 0,
            nb: self.intersample.gains(self.order(), self.form.degree()),
            nc: self.nc,
            nd: self.nd,
            nf: self.order(),
            nk,
        }
    }

    fn stable_blocks(&self) -> Vec<Range<usize>> {
        let first = self.elements.len();
        Vec::from_iter((self.nc > 0).then_some(first..first + self.nc))
    }

    fn map(&self, eta: &[f64], record: usize, sample: Option<usize>) -> Result<Mapped, ModelError> {
        let operator = self.operator(eta, record)?;
        let held = self.intersample.discrete(&operator, sample, self.sample_time)?;
        let noise = &eta[self.elements.len()..];
        let nb = held.b.len();
        let (coordinates, extra) = (self.coordinates(), noise.len());
        let mut theta = held.b.clone();
        theta.extend_from_slice(noise);
        theta.extend_from_slice(&held.f);
        let of_coordinate = |i: usize| {
            let slope = |row: &[f64; hoid_model::operator_family::PARTIALS]| row[i];
            let mut column: Vec<f64> = held.jacobian[..nb].iter().map(slope).collect();
            column.resize(nb + extra, 0.0);
            column.extend(held.jacobian[nb..].iter().map(slope));
            column
        };
        let of_noise = |k: usize| {
            let mut column = vec![0.0; theta.len()];
            column[nb + k] = 1.0;
            column
        };
        let columns = (0..coordinates).map(of_coordinate).chain((0..extra).map(of_noise));
        Ok(Mapped {
            orders: self.orders(held.nk),
            columns: columns.collect(),
            theta,
        })
    }
}
