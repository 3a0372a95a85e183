//! Reading the tables of a finished study.

use std::{collections::HashMap, path::Path};

use super::{
    rows::{SummaryRow, TraceStatistics, TraceSummary},
    study_results::Results,
};
use crate::{
    Plan, Statistics, StudyError,
    directory::PLAN_FILE,
    run_record::RunRecord,
    tables::{Columns, table_path},
};

impl Results {
    /// Reads the directory of a finished study, with tables in Parquet or CSV format.
    ///
    /// # Errors
    /// [`StudyError::NoStudy`] if the directory holds no study, [`StudyError::Unfinished`] if the study is incomplete,
    /// [`StudyError::OtherStudy`] if its plan has been changed, [`StudyError::Table`] if a table lacks a column or does
    /// not match the plan, [`StudyError::Io`] if a file cannot be read.
    pub fn read(directory: &Path) -> Result<Self, StudyError> {
        let shown = || directory.display().to_string();
        let manifest = RunRecord::read(directory)?.ok_or_else(|| StudyError::NoStudy { directory: shown() })?;
        if !manifest.complete {
            return Err(StudyError::Unfinished { directory: shown() });
        }
        let plan = Plan::read(&directory.join(PLAN_FILE))?.with_replications(manifest.replications)?;
        if plan.hash() != manifest.plan_sha256 {
            return Err(StudyError::OtherStudy {
                directory: shown(),
                reason: format!("its {PLAN_FILE} is not the plan that was run"),
            });
        }
        let mut results = Self::without_tables(plan);
        let at: HashMap<(u64, String), usize> = results
            .pairs
            .iter()
            .enumerate()
            .map(|(i, pair)| ((pair.key.cell, pair.key.estimator.clone()), i))
            .collect();
        results.read_summary(&Columns::read(directory, "summary")?, &at)?;
        results.read_fits(&Columns::read(directory, "fits")?, &at)?;
        if table_path(directory, "trace-summary").exists() {
            results.read_traces(&Columns::read(directory, "trace-summary")?)?;
        }
        Ok(results)
    }

    fn read_summary(&mut self, table: &Columns, at: &HashMap<(u64, String), usize>) -> Result<(), StudyError> {
        let (cells, labels, quantities) = (table.real("cell")?, table.text("estimator")?, table.text("quantity")?);
        let figure = |name: &str| table.real(name);
        let [count, missing, outliers] = [figure("count")?, figure("missing")?, figure("outliers")?];
        let [mean, mean_se, sd, sd_se] = [figure("mean")?, figure("mean_se")?, figure("sd")?, figure("sd_se")?];
        let [least, lower_whisker, lower_quartile, median] = [
            figure("least")?,
            figure("lower_whisker")?,
            figure("lower_quartile")?,
            figure("median")?,
        ];
        let [median_se, upper_quartile, upper_whisker, most] = [
            figure("median_se")?,
            figure("upper_quartile")?,
            figure("upper_whisker")?,
            figure("most")?,
        ];
        let [absolute_mean, truth] = [figure("absolute_mean")?, figure("truth")?];
        for (i, quantity) in quantities.iter().enumerate() {
            let pair = table.cell_estimator_index(at, cells[i], &labels[i])?;
            let statistics = Statistics {
                count: count[i] as usize,
                missing: missing[i] as usize,
                mean: mean[i],
                mean_se: mean_se[i],
                sd: sd[i],
                sd_se: sd_se[i],
                min: least[i],
                lower_whisker: lower_whisker[i],
                lower_quartile: lower_quartile[i],
                median: median[i],
                median_se: median_se[i],
                upper_quartile: upper_quartile[i],
                upper_whisker: upper_whisker[i],
                max: most[i],
                outliers: Vec::new(),
            };
            let of = &mut self.pairs[pair];
            of.rows.insert(quantity.clone(), self.rows.len());
            let s = of.key.clone();
            self.rows.push(SummaryRow {
                cell: s.cell,
                scenario: s.scenario,
                condition: s.condition,
                remnant_order: s.remnant_order,
                noise_level: s.noise_level,
                t_n_s: s.t_n_s,
                axes: s.axes,
                estimator: s.estimator,
                name: s.name,
                method: s.method,
                nd: s.nd,
                nk: s.nk,
                start: s.start,
                decimate: s.decimate,
                quantity: quantity.clone(),
                statistics,
                outliers: outliers[i] as usize,
                truth: truth[i],
                absolute_mean: absolute_mean[i],
            });
        }
        Ok(())
    }

    fn read_fits(&mut self, table: &Columns, at: &HashMap<(u64, String), usize>) -> Result<(), StudyError> {
        let (cells, labels, status) = (table.real("cell")?, table.text("estimator")?, table.text("status")?);
        for (i, label) in labels.iter().enumerate() {
            let pair = table.cell_estimator_index(at, cells[i], label)?;
            self.pairs[pair].fits.push(i);
        }
        for name in table.numeric_column_names() {
            self.fits.insert(name.to_owned(), table.real(name)?);
        }
        for (name, shown) in [("failed", "failed"), ("not_convertible", "not convertible")] {
            let hits = status
                .iter()
                .map(|status| f64::from(u8::from(status == shown)))
                .collect();
            self.fits.insert(name.to_owned(), hits);
        }
        Ok(())
    }

    fn read_traces(&mut self, table: &Columns) -> Result<(), StudyError> {
        let (cells, labels, times) = (table.real("cell")?, table.text("estimator")?, table.real("t")?);
        let names: Vec<String> = table
            .numeric_column_names()
            .filter_map(|name| name.strip_suffix("_median"))
            .map(str::to_owned)
            .collect();
        let mut columns = Vec::new();
        for name in names {
            let figure = |figure: &str| table.real(&format!("{name}_{figure}"));
            let five = [
                figure("mean")?,
                figure("sd")?,
                figure("lower_quartile")?,
                figure("median")?,
                figure("upper_quartile")?,
            ];
            columns.push((name, five));
        }
        let same = |i: usize| cells[i] == cells[i - 1] && labels[i] == labels[i - 1];
        let mut first = 0;
        for end in 1..=times.len() {
            if end < times.len() && same(end) {
                continue;
            }
            let span = first..end;
            let of = |values: &[f64]| values[span.clone()].to_vec();
            let parameters = columns
                .iter()
                .filter(|(_, five)| five[3][span.clone()].iter().any(|v| v.is_finite()));
            let parameters = parameters.map(|(name, five)| {
                let [mean, sd, lower_quartile, median, upper_quartile] = five.each_ref().map(|values| of(values));
                let bands = TraceStatistics {
                    mean,
                    sd,
                    lower_quartile,
                    median,
                    upper_quartile,
                };
                (name.clone(), bands)
            });
            let summary = TraceSummary {
                times_s: of(&times),
                parameters: parameters.collect(),
            };
            self.traces
                .insert((cells[first] as u64, labels[first].clone()), summary);
            first = end;
        }
        Ok(())
    }
}
