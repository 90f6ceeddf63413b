//! Figures, tables and the document of the question.

use std::path::Path;

use salp_core::analysis::{ExpectedCost, Resampling, Sample, best_of_n, ratio};
use salp_core::picture::{BandPicture, BandSeries, BandStep, Scale};
use serde_json::{Value, json};

use super::{Fidelity, Played};
use crate::output::{number, table};
use crate::run::reproduce::realised::TIPS;

/// An arm has come there when it is within this share of the best of all.
const WITHIN: f64 = 0.02;
const LEVELS: [f64; 3] = [0.1, 0.5, 0.9];
/// Costs at which a curve is drawn.
const COSTS: usize = 120;
/// The probes: middle of the right edge of units 8 and 9.
const PLACES: [u32; 2] = [640, 720];

/// Best score so far against CPU time, median and band: a figure, and as CSV.
pub fn figure(played: &[Played], tip: usize, fidelity: Fidelity) -> (String, String) {
    let mut csv = String::from("arm,cpu_s,percentile_10_mm2,median_mm2,percentile_90_mm2\n");
    let mut series = Vec::new();
    for arm in played {
        let sample = arm.sample(tip);
        let costs = costs(&sample);
        // Minimised is minus the area: the tenth part of the values is the upper end of the areas.
        let bands = best_of_n(&sample, &costs, &LEVELS, Resampling::default());
        let mut steps = Vec::new();
        for (cost, band) in costs.iter().zip(&bands) {
            let area = |k: usize| band[k].map(|value| -value);
            let [high, median, low] = [area(0), area(1), area(2)];
            let cell = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
            csv += &format!(
                "{},{cost},{},{},{}\n",
                arm.arm.id,
                cell(low),
                cell(median),
                cell(high)
            );
            steps.push(BandStep {
                at: *cost,
                middle: median,
                // Nothing found yet is no area.
                band: [low.or(high.map(|_| 0.0)), high],
            });
        }
        series.push(BandSeries {
            label: format!("{} ({} runs)", arm.arm.title, arm.scored.len()),
            steps,
        });
    }
    let total: f64 = played.iter().map(|arm| arm.sample(tip).total()).sum();
    let runs: usize = played.iter().map(|arm| arm.scored.len()).sum();
    let picture = BandPicture {
        title: format!(
            "Best area of nine units, tip at x = {} mm, against CPU time",
            PLACES[tip]
        ),
        x_label: "CPU time of restarts one after the other (s)".into(),
        y_label: "best area so far on nine units (mm\u{b2})".into(),
        scales: [Scale::Logarithmic, Scale::Linear],
        within: vec![0.0],
        top: None,
        series,
        level: None,
        caption: vec![
            format!(
                "Median, 10 to 90 % of {} bootstrap resamples over {runs} runs in all, {total:.0} CPU s.",
                Resampling::default().resamples
            ),
            said(fidelity),
        ],
    };
    (picture.svg(), csv)
}

/// Costs from the cheapest run to three times what all runs cost, evenly on a logarithmic axis.
fn costs(sample: &Sample) -> Vec<f64> {
    let totals = sample.runs.iter().map(salp_core::analysis::Trace::total);
    let first = totals.filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min);
    let last = sample.total().max(first);
    if !first.is_finite() {
        return Vec::new();
    }
    let step = (last / first).ln() / (COSTS - 1) as f64;
    (0..COSTS)
        .map(|k| first * (step * k as f64).exp())
        .collect()
}

fn said(fidelity: Fidelity) -> String {
    let iterations = fidelity.iterations;
    let at_most =
        iterations.map_or_else(String::new, |n| format!("; at most {n} iterations a run"));
    if fidelity.quick {
        let few = if iterations.is_some() {
            "few starts"
        } else {
            "few starts and iterations"
        };
        format!(
            "QUICK: coarse meshes, two load steps a leg, {few}; the numbers are those of such runs{at_most}"
        )
    } else {
        format!("Protocol: docs/open-question.md{at_most}.")
    }
}

/// What came out, as a document and as a text.
pub fn summary(played: &[Played], fidelity: Fidelity, out: &Path) -> (Value, String) {
    let mut lines = vec![
        "Does the hierarchy still pay when gradients are nearly free?".to_owned(),
        said(fidelity),
    ];
    let mut document = json!({"status": "ok", "quick": fidelity.quick, "iterations": fidelity.iterations, "folder": out.display().to_string()});
    for (tip, unit) in TIPS.iter().enumerate() {
        let best = played
            .iter()
            .filter_map(|arm| arm.sample(tip).best())
            .reduce(f64::min);
        let Some(best) = best else {
            lines.push(format!("no design counts at the end of unit {unit}"));
            continue;
        };
        // Minus the area: 2 % less of it.
        let target = best * (1.0 - WITHIN);
        let reference = played.first().map(|arm| arm.sample(tip));
        let first_arrives = reference.as_ref().is_some_and(|reference| {
            ExpectedCost::of(reference, target, Resampling::default()).hits > 0
        });
        let mut rows = Vec::new();
        let mut told = Vec::new();
        for arm in played {
            let sample = arm.sample(tip);
            let cost = ExpectedCost::of(&sample, target, Resampling::default());
            let ratio = reference
                .as_ref()
                .map(|reference| ratio(&sample, reference, target, Resampling::default()));
            let analyses: usize = arm.scored.iter().map(|s| s.analyses).sum();
            let own = arm.best(tip);
            let own_area = own.and_then(|s| s.areas_mm2).map(|areas| areas[tip]);
            let ends =
                |ends: [Option<f64>; 2]| format!("{} to {}", bounded(ends[0]), bounded(ends[1]));
            rows.push(vec![
                arm.arm.title.to_owned(),
                format!("{} of {}", arm.scored.len(), arm.starts),
                analyses.to_string(),
                number(Some(sample.total())),
                number(own_area),
                format!("{} of {}", cost.hits, cost.runs),
                bounded(cost.expected),
                ends(cost.interval),
                ratio.as_ref().map_or(String::new(), |r| {
                    if first_arrives {
                        format!("{} ({})", bounded(r.ratio), ends(r.interval))
                    } else {
                        "the first arm never came there".to_owned()
                    }
                }),
            ]);
            told.push(json!({
                "arm": arm.arm.id,
                "starts": arm.starts,
                "runs": cost.runs,
                "fe_analyses": analyses,
                "cpu_s": sample.total(),
                "best_area_mm2": own_area,
                "best_x": own.and_then(|s| s.x.clone()),
                "hits": cost.hits,
                "expected_cpu_s": cost.expected,
                "expected_cpu_s_interval": cost.interval,
                "ratio_to_first": ratio.as_ref().and_then(|r| r.ratio),
                "ratio_interval": ratio.as_ref().map(|r| r.interval),
            }));
        }
        let header = [
            "arm",
            "runs of starts",
            "FE analyses",
            "CPU s",
            "best area (mm\u{b2})",
            "runs within 2 %",
            "CPU s to within 2 %",
            "95 % interval",
            "ratio to the first arm",
        ];
        lines.push(format!(
            "Tip of unit {unit}, x = {}: within 2 % of the best of all, {} mm\u{b2}\n{}",
            PLACES[tip],
            number(Some(-best)),
            table(&header, &rows)
        ));
        document[format!("unit_{unit}")] = json!({"best_area_mm2": -best, "arms": told});
    }
    lines.push(format!("figures and restarts in {}", out.display()));
    (document, lines.join("\n"))
}

/// A cost that may be infinite: no run came there.
fn bounded(cost: Option<f64>) -> String {
    cost.map_or("none".to_owned(), |cost| number(Some(cost)))
}

/// Every restart with its score.
pub fn restarts(played: &[Played]) -> String {
    let mut csv = String::from(
        "arm,restart,objective,area_unit_8_mm2,area_unit_9_mm2,max_stretch_on_nine,fe_analyses,search_cpu_s,nine_units_cpu_s\n",
    );
    let cell = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
    for arm in played {
        for s in &arm.scored {
            csv += &format!(
                "{},{},{},{},{},{},{},{},{}\n",
                arm.arm.id,
                s.restart,
                cell(s.objective),
                cell(s.areas_mm2.map(|a| a[0])),
                cell(s.areas_mm2.map(|a| a[1])),
                cell(s.max_stretch),
                s.analyses,
                s.search_cpu_s,
                s.realised_cpu_s
            );
        }
    }
    csv
}
