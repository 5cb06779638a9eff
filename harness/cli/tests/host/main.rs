//! The host against FMUs: somebody else's (a C spring compiled here) and our own.

mod apart;
mod element;
mod instance;
mod ours;
mod scenario;
mod spring;
