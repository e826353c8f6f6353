//! The packets that leave and reach the wearable.
