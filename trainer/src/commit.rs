//! The version of this program, with the commit that it was built from if that is known.

/// The text that `--version` prints after the program's name.
pub(crate) const VERSION: &str = match COMMIT {
    // LINE has exactly the length for a commit of DIGITS digits.
    Some(_) => match std::str::from_utf8(&LINE) {
        Ok(line) => line,
        Err(_) => env!("CARGO_PKG_VERSION"),
    },
    None => env!("CARGO_PKG_VERSION"),
};

/// Number of printed digits of the commit.
const DIGITS: usize = 12;

/// The current commit, from git's log of HEAD. Each line of the log starts with the old commit, a space, and
/// the new commit.
#[cfg(commit)]
const COMMIT: Option<[u8; DIGITS]> = last_commit(include_bytes!(env!("GIT_HEAD_LOG")));
#[cfg(not(commit))]
const COMMIT: Option<[u8; DIGITS]> = None;

const LINE_BYTES: usize = env!("CARGO_PKG_VERSION").len() + " (commit )".len() + DIGITS;

/// The version and, if it is known, the commit.
const LINE: [u8; LINE_BYTES] = {
    let digits = match COMMIT {
        Some(digits) => digits,
        None => [b'0'; DIGITS],
    };
    let parts: [&[u8]; 4] = [
        env!("CARGO_PKG_VERSION").as_bytes(),
        b" (commit ",
        &digits,
        b")",
    ];
    let mut line = [0; LINE_BYTES];
    let (mut at, mut part) = (0, 0);
    while part < parts.len() {
        let mut index = 0;
        while index < parts[part].len() {
            line[at] = parts[part][index];
            at += 1;
            index += 1;
        }
        part += 1;
    }
    line
};

/// Returns the first digits of the new commit on the log's last line; None if that line is malformed.
const fn last_commit(log: &[u8]) -> Option<[u8; DIGITS]> {
    let mut end = log.len();
    while end > 0 && log[end - 1] == b'\n' {
        end -= 1;
    }
    let mut begin = end;
    while begin > 0 && log[begin - 1] != b'\n' {
        begin -= 1;
    }
    while begin < end && log[begin] != b' ' {
        begin += 1;
    }
    begin += 1;
    let mut digits = [0; DIGITS];
    let mut index = 0;
    while index < DIGITS {
        if begin + index >= end || !log[begin + index].is_ascii_hexdigit() {
            return None;
        }
        digits[index] = log[begin + index];
        index += 1;
    }
    Some(digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commit_is_last_in_log() {
        let log = b"0000000000000000 1111111111111111 A <a@b> 1 +0000\tclone: from x\n\
                    1111111111111111 0123456789abcdef A <a@b> 2 +0000\tcommit: y\n";
        assert_eq!(last_commit(log), Some(*b"0123456789ab"));
        for malformed in [
            &b""[..],
            b"\n",
            b"0000",
            b"0000 11",
            b"0000 xyz0123456789 A",
        ] {
            assert_eq!(last_commit(malformed), None);
        }
    }

    #[test]
    fn version_precedes_commit() {
        assert!(VERSION.starts_with(env!("CARGO_PKG_VERSION")), "{VERSION}");
        match COMMIT {
            Some(digits) => {
                let digits = str::from_utf8(&digits).unwrap();
                assert!(VERSION.contains(digits), "{VERSION}");
            }
            None => assert_eq!(VERSION, env!("CARGO_PKG_VERSION")),
        }
    }
}
