//! Source and destination of a frame.

/// An address of a card.
pub(super) type Mac = [u8; 6];

/// Destination and source of an Ethernet frame; `None` if it is too short to have them.
pub(super) fn addresses(frame: &[u8]) -> Option<(Mac, Mac)> {
    let (to, rest) = frame.split_first_chunk()?;
    let (from, _) = rest.split_first_chunk()?;
    Some((*to, *from))
}

/// Is it for one card only?
pub(super) fn is_for_one(to: Mac) -> bool {
    to[0] & 1 == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_destination_comes_first() {
        let frame: Vec<u8> = (0..14).collect();
        assert_eq!(addresses(&frame), Some(([0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11])));
        assert_eq!(addresses(&frame[..11]), None);
    }

    #[test]
    fn broadcast_and_multicast_are_for_all() {
        assert!(is_for_one([0x02, 0, 0, 0, 0, 1]));
        assert!(!is_for_one([0xff; 6]));
        assert!(!is_for_one([0x33, 0x33, 0, 0, 0, 1]));
    }
}
