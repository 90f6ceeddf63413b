//! In which direction the chambers of a unit follow each other, and in which order: one row of them, with a wall between
//! any two neighbours.

use crate::geometry::{Point, polygon};

/// One row of chambers.
#[derive(Debug, PartialEq)]
pub(super) struct ChamberRow {
    /// Their indices, from below or from the left.
    pub(super) order: Vec<usize>,
    /// Whether they lie on top of each other rather than side by side.
    pub(super) stacked: bool,
}

/// The row that chambers of a unit form: of the directions in which each is separated from the next, the one of the larger
/// least distance, and on top of each other where both are alike. What is wrong where there is none.
pub(super) fn chamber_row(chambers: &[Vec<Point>]) -> Result<ChamberRow, String> {
    let n = chambers.len();
    if n < 2 {
        return Ok(ChamberRow {
            order: (0..n).collect(),
            stacked: true,
        });
    }
    let offset = |a: usize, b: usize| polygon::separation(&chambers[a], &chambers[b]);
    let disjoint = (1..n).all(|b| (0..b).all(|a| offset(a, b).is_some()));
    if !disjoint {
        return Err("chambers that touch or overlap".into());
    }
    let along = |axis: usize| {
        let ahead = |a: usize, b: usize| offset(a, b).map_or(0.0, |o| o[axis]);
        let order = ordered(chambers, axis, ahead);
        let least = order.windows(2).map(|p| ahead(p[0], p[1]));
        (least.fold(f64::INFINITY, f64::min), order)
    };
    let ((beside, from_left), (above, from_below)) = (along(0), along(1));
    let (least, order, stacked) = if above >= beside {
        (above, from_below, true)
    } else {
        (beside, from_left, false)
    };
    if least > 0.0 {
        Ok(ChamberRow { order, stacked })
    } else {
        Err(format!(
            "{n} chambers that do not follow each other in one row, on top of each other or side by side"
        ))
    }
}

/// Chambers by their middle along an axis, and those that are behind the one before them (two may embrace) moved before it.
fn ordered(
    chambers: &[Vec<Point>],
    axis: usize,
    ahead: impl Fn(usize, usize) -> f64,
) -> Vec<usize> {
    let middle = |k: &usize| {
        let [low, high] = polygon::bounding_box(&chambers[*k]);
        f64::midpoint(low[axis], high[axis])
    };
    let mut order: Vec<usize> = (0..chambers.len()).collect();
    order.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
    for last in 1..order.len() {
        let mut k = last;
        while k > 0 && ahead(order[k - 1], order[k]) < 0.0 {
            order.swap(k - 1, k);
            k -= 1;
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle([x0, y0]: Point, [x1, y1]: Point) -> Vec<Point> {
        vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    #[test]
    fn rows_go_upwards_or_to_the_right() {
        let low = rectangle([5.0, 5.0], [70.0, 20.0]);
        let mid = rectangle([10.0, 25.0], [60.0, 40.0]);
        let high = rectangle([5.0, 45.0], [75.0, 75.0]);
        let row = |chambers: &[&Vec<Point>]| {
            let chambers: Vec<_> = chambers.iter().map(|c| (*c).clone()).collect();
            chamber_row(&chambers)
        };
        let expected = |order: &[usize], stacked: bool| {
            Ok(ChamberRow {
                order: order.to_vec(),
                stacked,
            })
        };
        assert_eq!(row(&[]), expected(&[], true));
        assert_eq!(row(&[&mid]), expected(&[0], true));
        assert_eq!(row(&[&high, &low]), expected(&[1, 0], true));
        assert_eq!(row(&[&high, &low, &mid]), expected(&[1, 2, 0], true));
        let turned =
            [&high, &low, &mid].map(|c| c.iter().map(|[x, y]| [*y, *x]).rev().collect::<Vec<_>>());
        assert_eq!(row(&turned.each_ref()), expected(&[1, 2, 0], false));
    }

    #[test]
    fn slanted_chambers_follow_each_other_though_their_boxes_overlap() {
        let slanted = |y: f64| {
            vec![
                [5.0, y],
                [75.0, y + 20.0],
                [75.0, y + 30.0],
                [5.0, y + 10.0],
            ]
        };
        let row = chamber_row(&[slanted(25.0), slanted(40.0), slanted(10.0)]).unwrap();
        assert_eq!((row.order, row.stacked), (vec![2, 0, 1], true));
    }

    #[test]
    fn what_is_no_row_is_refused() {
        let beside =
            [[5.0, 5.0], [45.0, 5.0]].map(|[x, y]| rectangle([x, y], [x + 30.0, y + 30.0]));
        let above = rectangle([5.0, 45.0], [75.0, 75.0]);
        let mut chambers = beside.to_vec();
        assert!(!chamber_row(&chambers).unwrap().stacked);
        chambers.push(above);
        assert!(chamber_row(&chambers).unwrap_err().contains("in one row"));
        chambers.push(rectangle([40.0, 40.0], [50.0, 50.0]));
        assert!(chamber_row(&chambers).unwrap_err().contains("overlap"));
    }
}
