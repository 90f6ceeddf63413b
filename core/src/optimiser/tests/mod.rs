//! The optimisers against published problems: values, counts, resumption, failures, time.

mod cases;
mod check_points;
mod conditions;
mod door;
mod exchange;
mod failures;
mod growth;
mod odd;
mod resume;
mod run;
mod screening;
mod speculation;
mod time;
mod without_gradients;
