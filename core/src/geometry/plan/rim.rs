//! A chamber's rim: its four sides, cut where polygon corners and the ends of arcs lie.

use super::logical_corners::logical_corners;
use super::size_rule::Span;
use crate::geometry::{Rounded, polygon};

/// A rounded corner is cut into blocks that each turn by this at most, radians, so that the rim stays near their chords.
const ANGLE_OF_PIECE: f64 = 0.5;
/// The last of them reaches a little beyond the arc: where a node passes from an arc to the straight part its second
/// derivative by the corners jumps, and a plan's own design should not lie there.
const BEYOND_ARC: f64 = 1.1;

/// A stretch of a chamber's rim along one polygon edge, in the direction of growing index.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) edge: usize,
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) span: Span,
}

/// The four sides of a chamber's rim.
pub(super) fn sides(chamber: &Rounded) -> [Vec<Piece>; 4] {
    let corners = chamber.corners();
    let anchors = logical_corners(corners);
    let n = corners.len();
    let shortest = (0..n)
        .map(|edge| polygon::distance(corners[edge], corners[(edge + 1) % n]))
        .fold(f64::INFINITY, f64::min);
    [0, 1, 2, 3].map(|side| {
        let (start, end) = (anchors[side], anchors[(side + 1) % 4]);
        let last = if end.edge + usize::from(end.fraction > start.fraction) > start.edge {
            end.edge
        } else {
            end.edge + n
        };
        let mut pieces = vec![];
        for turn in start.edge..=last {
            let edge = turn % n;
            let from = if turn == start.edge {
                start.fraction
            } else {
                0.0
            };
            let to = if turn == last { end.fraction } else { 1.0 };
            if to > from {
                pieces.extend(pieces_of_edge(chamber, edge, [from, to], shortest));
            }
        }
        // Top and left run against the index.
        if side >= 2 {
            pieces.reverse();
            for p in &mut pieces {
                std::mem::swap(&mut p.from, &mut p.to);
                p.span.graded.reverse();
            }
        }
        pieces
    })
}

/// A stretch of an edge: the arcs at its ends cut into small angles, and what is between them.
fn pieces_of_edge(
    chamber: &Rounded,
    edge: usize,
    [from, to]: [f64; 2],
    shortest: f64,
) -> Vec<Piece> {
    let length = chamber.length(edge);
    // Where the pieces of the arc at either end lie, as fractions from that end.
    let [first, last] = chamber.arcs(edge).map(|arc| {
        let Some(arc) = arc else { return vec![] };
        let parts = (arc.angle / ANGLE_OF_PIECE - 0.1).ceil() as usize;
        (1..=parts)
            .map(|k| BEYOND_ARC * arc.share * k as f64 / parts as f64)
            .collect::<Vec<_>>()
    });
    let arc_end = first.last().copied().unwrap_or(0.0);
    let arc_start = 1.0 - last.last().copied().unwrap_or(0.0);
    let mut cuts = vec![from];
    let inner = first
        .into_iter()
        .chain(last.into_iter().rev().map(|f| 1.0 - f));
    cuts.extend(inner.filter(|cut| *cut > from && *cut < to));
    cuts.push(to);
    cuts.windows(2)
        .map(|pair| {
            let [a, b] = [pair[0], pair[1]];
            let arc = b <= arc_end || a >= arc_start;
            Piece {
                edge,
                from: a,
                to: b,
                span: Span {
                    length: (b - a) * length,
                    graded: [a == arc_end && !arc, b == arc_start && !arc],
                    shortest,
                    wall: false,
                },
            }
        })
        .collect()
}
