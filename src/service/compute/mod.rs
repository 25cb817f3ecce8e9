//! Where computations run and what they may take: permits, the byte budget, the cache.

pub mod budget;
pub mod cache;
pub mod machine;
pub mod pool;
