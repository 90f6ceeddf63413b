//! Error bands of a small finite-element study.

use std::time::Duration;

use salp_protocol::{Axis, StudyId};
use serde_json::{Value, json};

use super::support::{Coordinator, Folder, serve, until, work};

/// Two restarts on coarse elements of one unit.
fn study(error_bands: bool) -> Value {
    json!({
        "name": "bands",
        "error_bands": error_bands,
        "material": "mold-star-30",
        "actuator": {"units": 1},
        "actuation": {"schedule": "hold", "pressure_kpa": 5, "load_steps_per_leg": 1},
        "step": [{
            "id": "rectangles",
            "target": {"kind": "enclosed_area", "probe_mm": [80, 40], "orientation": "counter_clockwise"},
            "model": {"kind": "fe_cascade", "element": "quad4", "max_size_mm": 20},
            "variables": {"parametrisation": "rectangle"},
            "optimiser": {"method": "gcmma", "max_iterations": 3},
            "restarts": {"start": "given", "points": [[10, 10], [20, 10]]},
        }],
    })
}

/// The evaluations whose points are bests, and what is known of their bands.
fn bands(coordinator: &Coordinator, id: &StudyId) -> (usize, usize) {
    let curve = coordinator.client.curve(id, Axis::Cpu).unwrap();
    let known = curve.best.iter().filter(|b| b.band_low.is_some()).count();
    for best in &curve.best {
        if let (Some(low), Some(high), Some(value)) =
            (best.band_low, best.band_high, best.point.best)
        {
            assert!(low < value && value < high, "{best:?}");
        }
    }
    (curve.best.len(), known)
}

#[test]
fn bands_fill_idle_workers_and_change_no_history() {
    let folder = Folder::new("bands");
    let mut coordinator = serve(&folder, "127.0.0.1:0", &["--lease", "1"]);
    let address = coordinator.url.trim_start_matches("http://").to_owned();
    let worker = work(&folder, &coordinator.url, &[]);
    let without = coordinator.submit(&study(false));
    let view = coordinator.until_done(&without);
    assert_eq!(view.counts.bands.evaluations, 0);
    assert_eq!(bands(&coordinator, &without).1, 0);
    drop(worker);

    // Every result but those of the bands is known already; the coordinator is killed with a band out.
    let with = coordinator.submit(&study(true));
    let _worker = work(&folder, &coordinator.url, &[]);
    until("a band is asked for", Duration::from_secs(20), || {
        coordinator.view(&with).counts.bands.evaluations > 0
    });
    coordinator.process.kill();
    coordinator = serve(&folder, &address, &["--lease", "1"]);
    let view = coordinator.until_done(&with);
    let (optimisers, of_bands) = (view.counts, view.counts.bands);
    assert!(of_bands.evaluations > 1 && of_bands.without_values == 0);
    assert_eq!(of_bands.answered, of_bands.evaluations);
    assert_eq!(
        optimisers.answered,
        coordinator.view(&without).counts.answered
    );
    assert_eq!(
        coordinator.histories(&with),
        coordinator.histories(&without)
    );
    let (bests, known) = bands(&coordinator, &with);
    assert_eq!(bests, known);
    let ledger = coordinator.ledger(&with);
    let of_bands = ledger.iter().filter(|row| row.kind == "band");
    for band in of_bands {
        let of = ledger
            .iter()
            .find(|r| Some(&r.evaluation) == band.band_of.as_ref());
        assert_eq!(of.unwrap().x, band.x);
    }
}
