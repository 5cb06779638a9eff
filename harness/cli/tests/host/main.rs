//! The host against FMUs: somebody else's (a C spring compiled here) and our own.

mod element;
mod instance;
mod ours;
mod scenario;
mod spring;
