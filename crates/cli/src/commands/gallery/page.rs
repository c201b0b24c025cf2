//! The page of the gallery: scenes in groups, and of each its picture with its command below.

/// File beside scenes that puts them into groups.
pub(super) const GROUPS: &str = "gallery.txt";

/// Pictures of a row: three of the default width fit a page on GitHub. `docs/gallery.css` makes a grid of them.
const COLUMNS: usize = 3;

/// A scene of the page.
pub(super) struct GalleryCard {
    pub(super) name: String,
    pub(super) title: String,
    /// The file, as a command names it.
    pub(super) scene: String,
    /// What the scene says about itself.
    pub(super) comment: String,
}

/// A heading of the page, and the names of the scenes below it.
#[derive(Debug, PartialEq)]
pub(super) struct GalleryGroup {
    pub(super) title: String,
    pub(super) scenes: Vec<String>,
}

/// Groups of a file `gallery.txt`: a title, and below it the names of its scenes, indented.
pub(super) fn groups(text: &str) -> Vec<GalleryGroup> {
    let mut groups: Vec<GalleryGroup> = Vec::new();
    for line in text.lines().filter(|line| !line.trim().is_empty()) {
        let word = line.trim().to_owned();
        match groups.last_mut() {
            Some(group) if line.starts_with([' ', '\t']) => group.scenes.push(word),
            _ => groups.push(GalleryGroup { title: word, scenes: Vec::new() }),
        }
    }
    groups
}

/// The page, whose pictures are in `folder`. Scenes that no group names come last.
pub(super) fn page(cards: &[GalleryCard], groups: &[GalleryGroup], folder: &str) -> String {
    let mut page = "# Gallery\n\n\
         The command below a picture runs its scene and plays it in the browser. `pliant gallery --force` makes\n\
         this page and its pictures again.\n\n\
         <div class=\"gallery\">\n"
        .to_owned();
    let mut rest: Vec<&GalleryCard> = cards.iter().collect();
    for group in groups {
        let mut chosen = Vec::new();
        for name in &group.scenes {
            if let Some(index) = rest.iter().position(|card| card.name == *name) {
                chosen.push(rest.remove(index));
            }
        }
        page += &section(&group.title, &chosen, folder);
    }
    page += &section(if groups.is_empty() { "Scenes" } else { "More scenes" }, &rest, folder);
    page + "\n</div>\n"
}

/// A heading with its table, or nothing for no scenes.
fn section(title: &str, cards: &[&GalleryCard], folder: &str) -> String {
    if cards.is_empty() {
        return String::new();
    }
    let mut section = format!("\n## {}\n", escaped(title));
    section += &format!("|{}\n|{}\n", " |".repeat(COLUMNS), "---|".repeat(COLUMNS));
    for row in cards.chunks(COLUMNS) {
        let cells =
            row.iter().map(|card| cell(card, folder)).chain(vec![" ".to_owned(); COLUMNS - row.len()]);
        section += &format!("|{}|\n", cells.collect::<Vec<_>>().join("|"));
    }
    section
}

fn cell(card: &GalleryCard, folder: &str) -> String {
    let GalleryCard { name, title, scene, comment } = card;
    let (title, comment) = (escaped(title), escaped(comment));
    let mut cell = format!(" ![{title}]({folder}/{name}.gif)<br>**{title}**<br>`pliant run {scene} --view`");
    if !comment.is_empty() {
        cell += &format!("<details><summary>What it shows</summary>{comment}</details>");
    }
    cell + " "
}

/// Text in a cell of Markdown: what a scene says is no markup, except code between backticks.
fn escaped(text: &str) -> String {
    let text = text.replace('\n', " ");
    let parts: Vec<&str> = text.split('`').collect();
    let paired = parts.len() % 2 == 1;
    let is_code = |index: usize| paired && index % 2 == 1;
    let parts: Vec<String> =
        parts.iter().enumerate().map(|(i, part)| if is_code(i) { code(part) } else { plain(part) }).collect();
    parts.join(if paired { "`" } else { "\\`" })
}

/// A bar ends a cell even in code.
fn code(text: &str) -> String {
    text.replace('|', "\\|")
}

fn plain(text: &str) -> String {
    code(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('[', "\\[")
        .replace('*', "\\*")
        .replace('_', "\\_")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn card(name: &str, title: &str, comment: &str) -> GalleryCard {
        let [name, title, comment] = [name, title, comment].map(str::to_owned);
        GalleryCard { scene: format!("scenes/{name}.toml"), name, title, comment }
    }

    #[test]
    fn groups_are_titles_with_indented_names() {
        let group = |title: &str, scenes: &[&str]| GalleryGroup {
            title: title.to_owned(),
            scenes: scenes.iter().map(|name| (*name).to_owned()).collect(),
        };
        let text = "Cloth and hair\n  a\n\n\tb\nEmpty\n";
        assert_eq!(groups(text), [group("Cloth and hair", &["a", "b"]), group("Empty", &[])]);
        assert_eq!(groups(" a\n b\n"), [group("a", &["b"])]);
    }

    #[test]
    fn scenes_stand_in_the_order_of_their_groups_and_the_others_last() {
        let cards = ["a", "b", "c", "d", "e"].map(|name| card(name, name, ""));
        let page = page(&cards, &groups("Two\n e\n b\n absent\nNone\n absent\n"), "gallery");
        let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text}: {page}"));
        let order = ["## Two\n", "e.gif", "b.gif", "## More scenes\n", "a.gif", "c.gif", "d.gif", "</div>"];
        assert!(order.windows(2).all(|pair| at(pair[0]) < at(pair[1])), "{page}");
        assert!(!page.contains("None") && !page.contains("<details>"), "{page}");
        let row = "| ![e](gallery/e.gif)<br>**e**<br>`pliant run scenes/e.toml --view` |";
        let rows = page.lines().filter(|line| line.starts_with('|'));
        assert!(page.contains(row) && rows.clone().count() == 6, "{page}");
        assert!(rows.into_iter().all(|line| line.matches('|').count() == COLUMNS + 1), "{page}");
    }

    #[test]
    fn markup_of_scenes_is_text_and_their_code_is_code() {
        let page = page(&[card("a", "<b>_x_[y](z)", "one `--a_b|c`\n|two*")], &[], "gallery");
        assert!(page.contains("## Scenes\n") && page.contains("**&lt;b>\\_x\\_\\[y](z)**"), "{page}");
        assert!(page.contains("</summary>one `--a_b\\|c` \\|two\\*</details> | | |\n"), "{page}");
        assert_eq!(escaped("a`b_c"), "a\\`b\\_c");
    }
}
