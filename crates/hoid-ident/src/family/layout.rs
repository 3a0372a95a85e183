//! Layout of eta: the coordinates of an operator and the coefficients of its noise model.
//!
//! `eta = [coordinates.., of channels.., c_1 .. c_nc, d_1 .. d_nd]`: the coordinates of the operator, the coordinates
//! of the further inputs, and the coefficients of the noise model `v = (C/D) eps`. A coordinate that is individual to
//! each record occurs once per record; the coordinates of channels and the noise model are common to all records. All
//! channels share the neuromuscular part of the operator.

use std::ops::Range;

use hoid_model::{
    FamilyOperator, ModelError, Orders, SampleTime,
    delayed_operator::whole_samples,
    operator_family::{Coordinate, Form},
};

use super::intersample::Intersample;
use crate::{
    criterion::further_input::InputOrders,
    grey_box::parametrisation::{DelayIntervals, MappedPolynomials, Parametrisation},
};

/// Indices in eta of the parameters of each record.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FamilyLayout {
    pub form: Form,
    pub neuromuscular: bool,
    pub nc: usize,
    pub nd: usize,
    pub sample_time: SampleTime,
    /// Intersample behaviour of the error.
    pub intersample: Intersample,
    /// For each record, the index in eta of each of its parameters.
    positions: Vec<Vec<usize>>,
    limits: Vec<(f64, f64)>,
    /// Coordinate and record of each element of the operator in eta; the record is `None` for an element common to all
    /// records.
    pub elements: Vec<(Coordinate, Option<usize>)>,
    /// The further inputs.
    pub channels: Vec<ChannelInLayout>,
}

/// The response to a further input.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChannelInLayout {
    pub form: Form,
    /// Bounds of the coordinates that only this channel has: all except those of the neuromuscular part.
    pub limits: Vec<(f64, f64)>,
    pub start: Vec<f64>,
    /// Index in eta of the first coordinate that only this channel has.
    pub place: usize,
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
            channels: Vec::new(),
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

    /// Returns the layout with further inputs added.
    pub fn with_channels(mut self, channels: &[ChannelInLayout]) -> Self {
        let noise = self.limits.split_off(self.elements.len());
        for positions in &mut self.positions {
            positions.truncate(self.form.coordinates(self.neuromuscular).len());
        }
        for channel in channels {
            self.channels.push(ChannelInLayout {
                place: self.limits.len(),
                ..channel.clone()
            });
            self.limits.extend_from_slice(&channel.limits);
        }
        let first = self.limits.len();
        self.limits.extend(noise);
        for record in 0..self.positions.len() {
            let of_channels: Vec<usize> = (self.channels.iter())
                .flat_map(|channel| self.channel_indices(channel, record))
                .collect();
            let positions = &mut self.positions[record];
            positions.extend(first..self.limits.len());
            positions.extend(of_channels);
        }
        self
    }

    /// Returns the index in eta of each coordinate of a channel, including the shared neuromuscular ones.
    pub fn channel_indices(&self, channel: &ChannelInLayout, record: usize) -> Vec<usize> {
        let of_operator = self.form.coordinates(self.neuromuscular);
        let mut own = channel.place..;
        let place = |coordinate: Coordinate| match coordinate {
            Coordinate::LogOmega | Coordinate::LogZeta => {
                let shared = of_operator.iter().position(|c| *c == coordinate);
                shared.map(|i| self.positions[record][i])
            }
            _ => own.next(),
        };
        let all = channel.form.coordinates(self.neuromuscular).into_iter();
        all.filter_map(place).collect()
    }

    /// Returns the operator from a channel to u in a record.
    pub fn channel(&self, eta: &[f64], channel: &ChannelInLayout, record: usize) -> Result<FamilyOperator, ModelError> {
        let x: Vec<f64> = (self.channel_indices(channel, record).iter())
            .map(|&place| eta[place])
            .collect();
        FamilyOperator::new(channel.form, self.neuromuscular, &x)
    }

    /// Returns the index in eta of the first coefficient of the noise model.
    pub fn noise_offset(&self) -> usize {
        self.elements.len() + self.channels.iter().map(|channel| channel.limits.len()).sum::<usize>()
    }

    /// Returns the number of coordinates of one operator.
    pub fn coordinate_count(&self) -> usize {
        self.form.coordinates(self.neuromuscular).len()
    }

    /// Returns the number of elements in eta that are coordinates of operators from e to u.
    pub fn operator_element_count(&self) -> usize {
        self.elements.len()
    }

    /// Returns the coordinates of the operator of a record.
    pub fn coordinates_of(&self, eta: &[f64], record: usize) -> Vec<f64> {
        let own = &self.positions[record][..self.coordinate_count()];
        own.iter().map(|&place| eta[place]).collect()
    }

    /// Returns eta with these coordinates for all records, the starting coordinates of the channels, and these
    /// coefficients of the noise model.
    pub fn common_eta(&self, coordinates: &[f64], noise: &[f64]) -> Vec<f64> {
        let all = self.form.coordinates(self.neuromuscular);
        let value = |(coordinate, _): &(Coordinate, Option<usize>)| {
            let index = all.iter().position(|c| c == coordinate).unwrap_or(0);
            coordinates[index]
        };
        let of_channels = self.channels.iter().flat_map(|channel| &channel.start);
        let operators = self.elements.iter().map(value);
        operators.chain(of_channels.chain(noise).copied()).collect()
    }

    /// Returns the operator of a record.
    pub fn operator(&self, eta: &[f64], record: usize) -> Result<FamilyOperator, ModelError> {
        FamilyOperator::new(self.form, self.neuromuscular, &self.coordinates_of(eta, record))
    }

    /// Returns the nk of the longest delay within the bounds.
    pub fn longest_nk(&self) -> Result<usize, ModelError> {
        let longest = self
            .delay_indices()
            .into_iter()
            .map(|i| self.limits[i].1)
            .fold(0.0, f64::max);
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

    fn delay_indices(&self) -> Vec<usize> {
        let delay = |i: &usize| self.elements[*i].0 == Coordinate::Delay;
        let of_channels = self
            .channels
            .iter()
            .map(|channel| channel.place + channel.limits.len() - 1);
        (0..self.elements.len()).filter(delay).chain(of_channels).collect()
    }

    fn delay_index(&self, record: usize) -> usize {
        self.positions[record][self.coordinate_count() - 1]
    }

    fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    fn first_interval_start(&self) -> f64 {
        if self.intersample == Intersample::Auto {
            -0.5
        } else {
            0.0
        }
    }

    fn orders(&self, nk: usize) -> Orders {
        Orders {
            na: 0,
            nb: self.intersample.numerator_length(self.order(), self.form.degree()),
            nc: self.nc,
            nd: self.nd,
            nf: self.order(),
            nk,
        }
    }

    fn stable_blocks(&self) -> Vec<Range<usize>> {
        let first = self.noise_offset();
        Vec::from_iter((self.nc > 0).then_some(first..first + self.nc))
    }

    fn further_input_orders(&self) -> Vec<InputOrders> {
        let muscles = if self.neuromuscular { 2 } else { 0 };
        let orders = |channel: &ChannelInLayout| {
            let order = usize::from(channel.form.has_pole()) + muscles;
            InputOrders {
                nb: self.intersample.numerator_length(order, channel.form.degree()),
                nf: order,
                nk: 1,
            }
        };
        self.channels.iter().map(orders).collect()
    }

    fn map(&self, eta: &[f64], record: usize, held: DelayIntervals<'_>) -> Result<MappedPolynomials, ModelError> {
        let operator = self.operator(eta, record)?;
        let found = self.intersample.discrete_model(
            &operator,
            held.sampling_interval(self.delay_index(record)),
            self.sample_time,
        )?;
        let noise = &eta[self.noise_offset()..];
        let orders = self.orders(found.nk);
        let mut theta = found.b.clone();
        theta.extend_from_slice(noise);
        theta.extend_from_slice(&found.f);
        // For each parameter: the derivatives of theta with respect to it, each with its index in theta.
        let mut slopes: Vec<Vec<(usize, f64)>> = Vec::new();
        let (nb, noise_end) = (found.b.len(), found.b.len() + noise.len());
        for i in 0..self.coordinate_count() {
            let rows = found.jacobian.iter().enumerate();
            let at = |row: usize| if row < nb { row } else { noise_end + row - nb };
            slopes.push(rows.map(|(row, slope)| (at(row), slope[i])).collect());
        }
        slopes.extend((nb..noise_end).map(|place| vec![(place, 1.0)]));
        let mut further = Vec::with_capacity(self.channels.len());
        for channel in &self.channels {
            let operator = self.channel(eta, channel, record)?;
            let delay = channel.place + channel.limits.len() - 1;
            let found = self
                .intersample
                .discrete_model(&operator, held.sampling_interval(delay), self.sample_time)?;
            let from = theta.len();
            theta.extend_from_slice(&found.b);
            theta.extend_from_slice(&found.f);
            for i in 0..operator.coordinates().len() {
                let rows = found.jacobian.iter().enumerate();
                slopes.push(rows.map(|(row, slope)| (from + row, slope[i])).collect());
            }
            further.push(InputOrders {
                nb: found.b.len(),
                nf: found.f.len(),
                nk: found.nk,
            });
        }
        let column = |slopes: &Vec<(usize, f64)>| {
            let mut column = vec![0.0; theta.len()];
            slopes.iter().for_each(|(place, slope)| column[*place] = *slope);
            column
        };
        Ok(MappedPolynomials {
            orders,
            further,
            columns: slopes.iter().map(column).collect(),
            theta,
        })
    }
}
