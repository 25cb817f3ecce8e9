//! What is true of the service.
