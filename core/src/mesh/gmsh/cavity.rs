//! Cavities from groups of edges, with the rule that closes an open chain.

use super::boundary::{Boundary, Chain};
use crate::fault::Faults;
use crate::mesh::{BoundaryEdge, Cavity, Support};

/// How an end of an open chain is held.
#[derive(Clone, Copy)]
enum End {
    /// Both components are prescribed.
    Fixed,
    /// Free along a component, on a line that does not move.
    Slides {
        /// 0: the line is horizontal; 1: it is vertical.
        along: usize,
    },
}

/// A cavity for each chain of a group's edges.
pub(super) fn cavities(
    boundary: &Boundary,
    chains: &[Chain],
    channel: usize,
    supports: &[Support],
    at: &[[f64; 2]],
    path: &str,
    faults: &mut Faults,
) -> Vec<Cavity> {
    let mut found = Vec::new();
    for chain in chains {
        // The boundary has the solid on its left; a cavity has itself there.
        let edges: Vec<BoundaryEdge> = chain
            .edges
            .iter()
            .rev()
            .map(|i| boundary.edges[*i])
            .map(|e| BoundaryEdge {
                ends: [e.ends[1], e.ends[0]],
                mid: e.mid,
            })
            .collect();
        let closing = if chain.closed {
            Some(Vec::new())
        } else {
            let first = edges[0].ends[0];
            let last = edges[edges.len() - 1].ends[1];
            let ends = [last, first].map(|node| held(node, supports, at, path, faults));
            match ends {
                [Some(from), Some(to)] => Some(closing_points(
                    (from, at[last as usize]),
                    (to, at[first as usize]),
                )),
                _ => None,
            }
        };
        if let Some(closing_points_mm) = closing {
            found.push(Cavity {
                channel,
                edges,
                closing_points_mm,
                closed: chain.closed,
            });
        }
    }
    found
}

fn held(
    node: u32,
    supports: &[Support],
    at: &[[f64; 2]],
    path: &str,
    faults: &mut Faults,
) -> Option<End> {
    let of = |component: u8| {
        supports
            .iter()
            .find(|s| s.node == node && s.component == component)
    };
    let [x, y] = at[node as usize];
    match (of(0), of(1)) {
        (Some(_), Some(_)) => Some(End::Fixed),
        (Some(s), None) | (None, Some(s)) if s.displacement_mm == 0.0 => Some(End::Slides {
            along: 1 - s.component as usize,
        }),
        (None, None) => {
            faults.add(
                path,
                format!(
                    "the edges are not closed and end at ({x}, {y}) mm, which is neither fixed nor on a support that it slides on"
                ),
            );
            None
        }
        _ => {
            faults.add(
                path,
                format!(
                    "the edges are not closed and end at ({x}, {y}) mm on a support that moves; expected one that stands still"
                ),
            );
            None
        }
    }
}

/// The fixed points between the last end and the first one. A sliding end is followed (or preceded) by a point of its
/// line, so that the area does not change to first order with the closing line as the end slides: the line carries no
/// load. Two lines that meet share their meeting point, which makes the area that of the body's cavity.
fn closing_points(last: (End, [f64; 2]), first: (End, [f64; 2])) -> Vec<[f64; 2]> {
    let foot = |along: usize, end: [f64; 2], other: [f64; 2]| {
        let mut foot = end;
        foot[along] = other[along];
        foot
    };
    match (last, first) {
        ((End::Fixed, _), (End::Fixed, _)) => Vec::new(),
        ((End::Slides { along }, end), (End::Fixed, other))
        | ((End::Fixed, other), (End::Slides { along }, end)) => vec![foot(along, end, other)],
        ((End::Slides { along: a }, p), (End::Slides { along: b }, q)) if a != b => {
            vec![foot(a, p, q)]
        }
        ((End::Slides { along }, p), (End::Slides { .. }, q)) => {
            if p[1 - along] == q[1 - along] {
                vec![p]
            } else {
                vec![p, q]
            }
        }
    }
}
