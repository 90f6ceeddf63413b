//! The optimisers against published problems: values, counts, resumption, failures, time.

mod cases;
mod check_points;
mod run;
mod table;
