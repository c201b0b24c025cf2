//! Assembly of the HTML page.

use pliant_files::base64;

use serde_json::json;

use super::LiveLink;
use super::codec::deflate;
use super::pack::Packed;

/// Last directive of the template's content security policy.
const IMAGES: &str = "img-src data: blob:";
const TEMPLATE: &str = include_str!("../../page/page.html");
const STYLE: &str = concat!(include_str!("../../page/page.css"), include_str!("../../page/live.css"));
const STARTER: &str = include_str!("../../page/starter.js");
const CORE: &str = include_str!("../../vendor/three/three.core.min.js");
const THREE: &str = include_str!("../../vendor/three/three.module.min.js");
const ORBIT: &str = include_str!("../../vendor/three/OrbitControls.js");

/// Modules of the page, by their import names.
const MODULES: [(&str, &str); 17] = [
    ("pliant/main", include_str!("../../page/main.js")),
    ("pliant/view", include_str!("../../page/view.js")),
    ("pliant/data", include_str!("../../page/data.js")),
    ("pliant/shaders", include_str!("../../page/shaders.js")),
    ("pliant/body", include_str!("../../page/body.js")),
    ("pliant/stage", include_str!("../../page/stage.js")),
    ("pliant/loads", include_str!("../../page/loads.js")),
    ("pliant/charts", include_str!("../../page/charts.js")),
    ("pliant/panel", include_str!("../../page/panel.js")),
    ("pliant/inspector", include_str!("../../page/inspector.js")),
    ("pliant/live", include_str!("../../page/live.js")),
    ("pliant/link", include_str!("../../page/link.js")),
    ("pliant/numbers", include_str!("../../page/numbers.js")),
    ("pliant/controls", include_str!("../../page/controls.js")),
    ("pliant/grab", include_str!("../../page/grab.js")),
    ("pliant/rolling", include_str!("../../page/rolling.js")),
    ("pliant/fault", include_str!("../../page/fault.js")),
];

/// Builds the page. A `live` page contains the path of its socket and may connect to it, or waits for a port.
pub(super) fn html(packed: &Packed, live: Option<&LiveLink>) -> String {
    let head = deflate(packed.head.to_string().as_bytes());
    let mut data = block("data", "head", &head);
    packed.blocks.iter().for_each(|(name, bytes)| data.push_str(&block("data", name, bytes)));
    // A module from a blob cannot import another by a relative path.
    let three = THREE.replace("./three.core.min.js", "three-core");
    let libraries = [("three-core", CORE), ("three", &three), ("orbit", ORBIT)];
    let modules: String = libraries
        .into_iter()
        .chain(MODULES)
        .map(|(name, text)| block("module", name, &deflate(text.as_bytes())))
        .collect();
    // Blocks are inserted last, so that nothing in them is mistaken for a placeholder of the template.
    let page = TEMPLATE.replacen("/*style*/", STYLE, 1).replacen("/*starter*/", STARTER, 1);
    let page = match live {
        Some(LiveLink::Socket(socket)) => {
            page.replacen(IMAGES, &format!("{IMAGES}; connect-src ws://{}", socket.host), 1)
        }
        Some(LiveLink::Port) | None => page,
    };
    page.replacen("<!--blocks-->", &(element(live) + &modules + &data), 1)
}

/// Element with the path of the socket, which consists of letters, digits and slashes, or `port`.
fn element(live: Option<&LiveLink>) -> String {
    live.map_or(String::new(), |link| {
        let link = match link {
            LiveLink::Socket(socket) => json!({ "socket": socket.path }),
            LiveLink::Port => json!({ "port": true }),
        };
        format!("<script type=\"application/json\" id=\"live\">{link}</script>\n")
    })
}

/// Inert text in the page; names are from this program, and the content is base 64.
fn block(kind: &str, name: &str, bytes: &[u8]) -> String {
    format!("<script type=\"text/plain\" data-{kind}=\"{name}\">{}</script>\n", base64::encode(bytes))
}
