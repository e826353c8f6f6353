//! Probabilistic movement primitives in latent form.
