//! The part of palpate that also runs on a microcontroller.
#![no_std]
#![forbid(unsafe_code)]
