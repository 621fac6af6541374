//! palpate.
