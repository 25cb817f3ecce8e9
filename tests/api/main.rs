//! Tests of the service over HTTP and on the command line.
#![allow(
    clippy::float_cmp,
    clippy::unwrap_used,
    reason = "tests compare exactly where values are exact, and fail by panicking"
)]

mod accuracy;
mod asking;
mod backlash;
mod batch;
mod caching;
mod codes;
mod command_line;
mod contact;
mod containers;
mod designs;
mod deviations;
mod documents;
mod drawings;
mod dxf;
mod endpoints;
mod entry;
mod examples;
mod extremes;
mod findings;
mod fingers;
mod friction;
mod meshes;
mod modification;
mod openapi;
mod operations;
mod paper;
mod plug_ins;
mod prefixes;
mod problems;
mod profiles;
mod ranges;
mod rules;
mod serving;
mod stopping;
mod stored;
mod studies;
mod violations;
