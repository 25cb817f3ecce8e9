//! Resources of computations: permits, threads, the byte budget, the cache.

pub mod budget;
pub mod cache;
pub mod machine;
pub mod pool;
