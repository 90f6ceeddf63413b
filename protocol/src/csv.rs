//! Results as CSV, the same from the coordinator and from the command line: a header line, then a line a row.

use std::fmt::{Display, Write as _};

use crate::results::{Curve, CurvePoint, EvaluationRow};

/// A number; empty where there is none.
pub fn cell<T: Display>(value: Option<T>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// A curve, a line a point: first those of the restarts, then, without a restart, those of the best over all of them.
pub fn curve(curve: &Curve) -> String {
    let mut text = String::from(
        "step,restart,t_s,evaluations,objective,best,max_violation,feasible,overlap,band_low,band_high,tie,coarse\n",
    );
    let mut line = |restart: Option<usize>, point: &CurvePoint, band: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{band},{}",
            point.step,
            cell(restart),
            point.t_s,
            point.evaluations,
            cell(point.objective),
            cell(point.best),
            cell(point.max_violation),
            point.feasible,
            point.overlap,
            point.coarse
        );
    };
    for restart in &curve.restarts {
        for point in &restart.points {
            line(Some(restart.index), point, ",,");
        }
    }
    for best in &curve.best {
        let band = format!(
            "{},{},{}",
            cell(best.band_low),
            cell(best.band_high),
            best.tie
        );
        line(None, &best.point, &band);
    }
    text
}

/// A ledger, a line an evaluation.
pub fn ledger(rows: &[EvaluationRow]) -> String {
    let mut text = String::from(
        "evaluation,step,restart,batch,batch_index,kind,iteration,status,objective,max_violation,feasible,overlap,\
         cached_from,wall_s,cpu_s,worker,attempt,fence,created_ms,finished_ms,band_of,mesh_share,load_steps_per_leg,x\n",
    );
    for row in rows {
        let x: Vec<String> = row.x.iter().map(f64::to_string).collect();
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
            row.evaluation,
            row.step,
            row.restart,
            row.batch,
            row.batch_index,
            row.kind,
            row.iteration,
            row.status,
            cell(row.objective),
            cell(row.max_violation),
            row.feasible,
            row.overlap,
            cell(row.cached_from.as_ref()),
            cell(row.wall_s),
            cell(row.cpu_s),
            quoted(row.worker.as_ref().map_or("", |worker| &worker.0)),
            row.attempt,
            row.fence,
            row.created_ms,
            cell(row.finished_ms),
            cell(row.band_of.as_ref()),
            cell(row.fidelity.map(|fidelity| fidelity.mesh)),
            cell(
                row.fidelity
                    .and_then(|fidelity| fidelity.load_steps_per_leg)
            ),
            x.join(" ")
        );
    }
    text
}

/// A text cell; a worker names itself, so its id may hold anything.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::{Axis, BestSoFar, RestartCurve};
    use crate::{BandCounts, EvaluationId, WorkerId};

    #[test]
    fn lines_have_as_many_cells_as_their_header() {
        let point = CurvePoint {
            step: 0,
            t_s: 0.5,
            evaluations: 1,
            objective: None,
            best: Some(-2.5),
            max_violation: None,
            feasible: false,
            overlap: false,
            coarse: false,
        };
        let restarts = vec![RestartCurve {
            step: 0,
            index: 3,
            points: vec![point.clone()],
        }];
        let best = BestSoFar {
            point,
            band_low: Some(-3.0),
            band_high: Some(-2.0),
            tie: true,
        };
        let text = curve(&Curve {
            axis: Axis::Cpu,
            restarts,
            best: vec![best],
            bands: BandCounts::default(),
        });
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1], "0,3,0.5,1,,-2.5,,false,false,,,,false");
        assert_eq!(lines[2], "0,,0.5,1,,-2.5,,false,false,-3,-2,true,false");
        assert_eq!(lines[0].split(',').count(), 13);
        let text = ledger(&[EvaluationRow {
            evaluation: EvaluationId(7),
            step: 0,
            restart: 0,
            batch: 0,
            batch_index: 0,
            kind: "initial".into(),
            band_of: None,
            fidelity: None,
            iteration: 0,
            x: vec![1.0, 0.5],
            status: "ok".into(),
            objective: Some(1.0),
            max_violation: Some(0.0),
            feasible: true,
            overlap: false,
            cached_from: None,
            wall_s: None,
            cpu_s: None,
            worker: Some(WorkerId("a \"b\"".into())),
            attempt: 1,
            fence: 1,
            created_ms: 5,
            finished_ms: None,
            outcome: None,
        }]);
        let [header, line] = text.lines().collect::<Vec<_>>()[..] else {
            panic!("{text}")
        };
        assert_eq!(line.split(',').count(), header.split(',').count());
        assert!(line.contains("\"a \"\"b\"\"\"") && line.ends_with(",1 0.5"));
    }
}
