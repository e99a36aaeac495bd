//! The little HTML that every part of a page needs.

/// Text as HTML: nothing in it is taken for markup, in content or in quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            other => html.push(other),
        }
    }
    html
}

/// Text as part of a file name: small letters, digits and single hyphens.
pub(super) fn slug(text: &str) -> String {
    let words: Vec<String> = text
        .split(|character: char| !character.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_ascii_lowercase)
        .collect();
    words.join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_becomes_text() {
        assert_eq!(
            escape("<a b='c'>&\"é"),
            "&lt;a b=&#39;c&#39;&gt;&amp;&quot;é"
        );
    }

    #[test]
    fn slugs_are_safe_file_names() {
        assert_eq!(slug("../Blue Rubber (2)/é"), "blue-rubber-2");
        assert_eq!(slug("***"), "");
    }
}
