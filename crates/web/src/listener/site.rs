//! The names of this site. Requests under other names are refused, because another site could have its name resolve to
//! this address (DNS rebinding); so are forms of other sites.

use std::net::{IpAddr, SocketAddr};

/// The names of this site.
#[derive(Debug, Clone, Default)]
pub(crate) struct Site {
    /// Whether this process serves TLS.
    pub(crate) is_tls: bool,
    /// The page's address at the reverse proxy.
    pub(crate) proxy: Option<PageAddress>,
    /// Additional names in lower case: NAME with the listening port, or NAME:PORT.
    pub(crate) names: Vec<String>,
}

/// The address of a page: its origin as browsers define it (scheme, name and port), and the path under which a reverse
/// proxy has it, which the proxy strips.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PageAddress {
    scheme: &'static str,
    authority: String,
    /// Without a slash at the end; empty at the root.
    path: String,
}

/// An invalid address of a page.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not the address of a page over TLS; write https://NAME, https://NAME:PORT or https://NAME/PATH, or http:// for localhost"
)]
pub struct PageAddressError(String);

impl std::str::FromStr for PageAddress {
    type Err = PageAddressError;

    fn from_str(text: &str) -> Result<Self, PageAddressError> {
        let wrong = || PageAddressError(vocabulary::quotation(text, 200));
        let (scheme, rest) = text.split_once("://").ok_or_else(wrong)?;
        let (authority, path) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
        let path = path.strip_suffix('/').unwrap_or(path);
        if !path.split('/').skip(1).all(is_segment) {
            return Err(wrong());
        }
        let authority = authority.to_ascii_lowercase();
        let (name, port) = split(&authority).ok_or_else(wrong)?;
        let scheme = match scheme.to_ascii_lowercase().as_str() {
            "https" => "https",
            "http" if is_this_machine(name) => "http",
            _ => return Err(wrong()),
        };
        // Browsers omit the default port.
        let is_usual = port == Some(usual_port(scheme == "https"));
        let authority = if is_usual { name } else { &authority };
        Ok(Self { scheme, authority: authority.to_owned(), path: path.to_owned() })
    }
}

impl PageAddress {
    fn origin(&self) -> String {
        format!("{}://{}", self.scheme, self.authority)
    }
}

impl std::fmt::Display for PageAddress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}", self.origin(), self.path)
    }
}

impl Site {
    /// Whether browsers connect over TLS, which determines the attributes of cookies.
    pub(crate) fn is_secure(&self) -> bool {
        self.proxy.as_ref().map_or(self.is_tls, |proxy| proxy.scheme == "https")
    }

    /// The path under which the reverse proxy has this site, without a slash at the end; empty at the root.
    pub(crate) fn path(&self) -> &str {
        self.proxy.as_ref().map_or("", |proxy| &proxy.path)
    }

    /// HTML whose links, forms and resources are those of the site under its path. In the text of a page quotation
    /// marks are escaped, so only attributes are changed.
    pub(crate) fn based(&self, html: &str) -> String {
        let path = self.path();
        ["href", "src", "action"].iter().fold(html.to_owned(), |html, name| {
            html.replace(&format!(" {name}=\"/"), &format!(" {name}=\"{path}/"))
        })
    }

    /// The origin of a page requested as `host` over a connection to `local`; `None` if the name is not this site's.
    pub(crate) fn origin(&self, host: &str, local: SocketAddr) -> Option<String> {
        let host = host.to_ascii_lowercase();
        match &self.proxy {
            Some(proxy) if host == proxy.authority || self.is_own(&host, local) => {
                Some(proxy.origin())
            }
            None if self.is_own(&host, local) => {
                let scheme = if self.is_tls { "https" } else { "http" };
                Some(format!("{scheme}://{host}"))
            }
            _ => None,
        }
    }

    fn is_own(&self, host: &str, local: SocketAddr) -> bool {
        let Some((name, port)) = split(host) else { return false };
        if self.names.iter().any(|own| own == host) {
            return true;
        }
        if port.unwrap_or(usual_port(self.is_tls)) != local.port() {
            return false;
        }
        let here = local.ip().to_canonical();
        ip(name) == Some(here)
            || (here.is_loopback() && is_this_machine(name))
            || self.names.iter().any(|own| own == name)
    }
}

/// Part of a path that needs no escaping in URLs, HTML and cookies.
fn is_segment(text: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    !matches!(text, "" | "." | "..") && text.bytes().all(allowed)
}

fn usual_port(is_tls: bool) -> u16 {
    if is_tls { 443 } else { 80 }
}

fn is_this_machine(name: &str) -> bool {
    name == "localhost" || ip(name).is_some_and(|address| address.is_loopback())
}

fn ip(name: &str) -> Option<IpAddr> {
    let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']'));
    bare.map_or_else(|| name.parse().ok(), |bare| bare.parse().ok().map(IpAddr::V6))
}

/// Splits `NAME`, `NAME:PORT` or `[ADDRESS]:PORT` into name and port.
fn split(authority: &str) -> Option<(&str, Option<u16>)> {
    let end_of_address = authority.find(']').map_or(0, |end| end + 1);
    let colon = authority[end_of_address..].rfind(':').map(|colon| end_of_address + colon);
    let (name, port) = match colon {
        Some(colon) => (&authority[..colon], Some(authority[colon + 1..].parse().ok()?)),
        None => (authority, None),
    };
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'_');
    let is_name = !name.is_empty() && name.bytes().all(allowed);
    (is_name || ip(name).is_some()).then_some((name, port))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOPBACK: &str = "127.0.0.1:8480";

    fn origin(site: &Site, host: &str, local: &str) -> Option<String> {
        site.origin(host, local.parse().unwrap())
    }

    #[test]
    fn on_the_loopback_it_goes_by_the_names_of_this_machine() {
        let site = Site::default();
        for host in ["127.0.0.1:8480", "localhost:8480", "LOCALHOST:8480", "[::1]:8480"] {
            let expected = format!("http://{}", host.to_ascii_lowercase());
            assert_eq!(origin(&site, host, LOOPBACK), Some(expected));
        }
        for host in [
            "evil.example:8480",
            "localhost",
            "localhost:80",
            "localhost:8480:8480",
            "",
            "a b",
            "192.0.2.1:8480",
        ] {
            assert_eq!(origin(&site, host, LOOPBACK), None, "{host}");
        }
    }

    #[test]
    fn elsewhere_it_goes_by_its_address_and_the_names_that_are_given() {
        let names = vec!["tower.example".to_owned(), "desk:9000".to_owned()];
        let site = Site { is_tls: true, names, ..Site::default() };
        let local = "192.0.2.10:443";
        for host in
            ["192.0.2.10", "192.0.2.10:443", "tower.example", "Tower.Example:443", "desk:9000"]
        {
            assert!(origin(&site, host, local).is_some(), "{host}");
        }
        for host in ["localhost", "192.0.2.11", "tower.example:8480", "desk", "x.tower.example"] {
            assert_eq!(origin(&site, host, local), None, "{host}");
        }
        assert_eq!(
            origin(&site, "192.0.2.10", "[::ffff:192.0.2.10]:443").unwrap(),
            "https://192.0.2.10"
        );
    }

    #[test]
    fn behind_a_proxy_the_origin_is_the_proxys() {
        let proxy: PageAddress = "https://Tower.example:443/".parse().unwrap();
        let site = Site { proxy: Some(proxy), ..Site::default() };
        assert!(site.is_secure());
        for host in ["tower.example", "127.0.0.1:8480"] {
            assert_eq!(origin(&site, host, LOOPBACK).unwrap(), "https://tower.example");
        }
        assert_eq!(origin(&site, "evil.example", LOOPBACK), None);
    }

    #[test]
    fn under_a_path_of_the_proxy_links_lead_there_and_text_stays() {
        for (address, path) in [("https://a.example/Shm/east/", "/Shm/east"), ("https://a/", "")] {
            let proxy: PageAddress = address.parse().unwrap();
            assert_eq!(proxy.to_string(), address.trim_end_matches('/'));
            let site = Site { proxy: Some(proxy), ..Site::default() };
            assert_eq!(site.path(), path);
            let html = maud::html! {
                a href="/events" title=" href=\"/" { " href=\"/" } a href="#main" {}
                script src="/page.js" {} form action="/order/reset" { input value="/"; }
            };
            let html = html.into_string();
            let expected = html.replace("\"/events", &format!("\"{path}/events"));
            let expected = expected.replace("\"/page.js", &format!("\"{path}/page.js"));
            let expected = expected.replace("\"/order", &format!("\"{path}/order"));
            assert_eq!(site.based(&html), expected);
        }
    }

    #[test]
    fn an_origin_without_tls_is_one_of_this_machine() {
        assert_eq!(
            "http://localhost:9000".parse::<PageAddress>().unwrap().to_string(),
            "http://localhost:9000"
        );
        for wrong in [
            "http://tower.example",
            "tower.example",
            "https://",
            "https://a//b",
            "https://a/../b",
            "https://a/b?c",
            "https://a/b c",
            "ftp://a",
            "https://a@b",
        ] {
            let error = wrong.parse::<PageAddress>().unwrap_err().to_string();
            assert!(error.contains("write https://NAME"), "{error}");
        }
    }
}
