//! The servers that a client asks for its room, one after another. They let the client follow a room from one server in
//! a fleet to another, and find it again if its server dies. The client provides timing and sockets.

use crate::limits::NODES_MAX;

/// The servers that a client knows.
#[derive(Clone, Debug)]
pub struct Servers {
    known: Vec<String>,
    /// Index of the server that plays the room or is asked next. The others follow in order, as in a ring.
    current: usize,
    /// The current server has seated the client.
    seated: bool,
    /// The client has followed a move immediately, and no server has seated it since.
    followed: bool,
    /// Number of failed attempts since the client was last seated.
    failed: usize,
}

impl Servers {
    /// Starts with a single server, given by its origin.
    pub fn new(first: String) -> Servers {
        Servers { known: vec![first], current: 0, seated: false, followed: false, failed: 0 }
    }

    /// Origin of the server that plays the room or is asked next.
    pub fn current(&self) -> &str {
        &self.known[self.current]
    }

    /// Called when the current server has welcomed the client.
    pub fn welcomed(&mut self) {
        (self.seated, self.followed, self.failed) = (true, false, 0);
    }

    /// Called when the current server has listed the others.
    pub fn told(&mut self, nodes: Vec<String>) {
        let current = std::mem::take(&mut self.known[self.current]);
        self.known = nodes;
        self.choose(current);
    }

    fn choose(&mut self, url: String) {
        let index = self.known.iter().position(|known| *known == url);
        self.current = index.unwrap_or_else(|| {
            self.known.truncate(NODES_MAX);
            self.known.push(url);
            self.known.len() - 1
        });
    }

    /// Called when the client learns that the room is on this server. Returns whether to connect immediately. After the
    /// second move in a row without a seat, it returns false, because the servers may disagree.
    pub fn moved(&mut self, url: String) -> bool {
        self.choose(url);
        self.seated = false;
        self.followed = !self.followed;
        self.failed += usize::from(!self.followed);
        self.followed
    }

    /// Called when the socket was lost or no connection was made. A server that had seated the client is asked again
    /// first; a server that had not is asked after all the others.
    pub fn lost(&mut self) {
        self.followed = false;
        if !std::mem::take(&mut self.seated) {
            self.current = (self.current + 1) % self.known.len();
            self.failed += 1;
        }
    }

    /// Called when a server has answered that the room is moving, so all servers may be asked again soon.
    pub fn moving(&mut self) {
        self.failed = 0;
    }

    /// Whether more than one server is known.
    pub fn has_others(&self) -> bool {
        self.known.len() > 1
    }

    /// Whether more than one server is known, and at least one has not been asked since the client was last seated.
    pub fn has_untried(&self) -> bool {
        self.has_others() && self.failed < self.known.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seated(nodes: &[&str]) -> Servers {
        let mut servers = Servers::new("a".to_owned());
        servers.welcomed();
        servers.told(nodes.iter().map(|&node| node.to_owned()).collect());
        servers
    }

    /// The servers that are asked, one after another, while none of them answers.
    fn asked(servers: &mut Servers, count: usize) -> Vec<String> {
        let ask = |_| {
            servers.lost();
            servers.current().to_owned()
        };
        (0..count).map(ask).collect()
    }

    #[test]
    fn after_a_loss_the_same_server_comes_first_and_then_the_others_in_turn() {
        let mut servers = seated(&["b", "c"]);
        assert_eq!(asked(&mut servers, 5), ["a", "b", "c", "a", "b"]);
        servers.welcomed();
        assert_eq!(asked(&mut servers, 2), ["b", "c"]);
    }

    #[test]
    fn a_server_that_is_among_its_others_is_asked_once() {
        let mut servers = seated(&["b", "a", "c"]);
        assert_eq!(asked(&mut servers, 4), ["a", "c", "b", "a"]);
    }

    #[test]
    fn untried_servers_are_left_until_each_was_asked() {
        let mut servers = seated(&["b"]);
        servers.lost();
        assert!(servers.has_untried(), "a and b");
        servers.lost();
        assert!(servers.has_untried(), "b");
        servers.lost();
        assert!(!servers.has_untried());
        servers.moving();
        assert!(servers.has_untried());
        let mut alone = seated(&[]);
        alone.lost();
        assert!(!alone.has_untried());
        assert_eq!(asked(&mut alone, 2), ["a", "a"]);
    }

    #[test]
    fn a_move_is_followed_at_once_and_the_old_server_stays_known() {
        let mut servers = seated(&["b"]);
        for url in ["c", "a", "c"] {
            assert!(servers.moved(url.to_owned()), "{url}");
            assert_eq!(servers.current(), url);
            servers.welcomed();
        }
        assert_eq!(asked(&mut servers, 4), ["c", "b", "a", "c"]);
    }

    #[test]
    fn servers_that_disagree_are_waited_for() {
        let mut servers = seated(&[]);
        let mut at_once = Vec::new();
        for url in ["b", "a", "b", "a"] {
            at_once.push(servers.moved(url.to_owned()));
        }
        assert_eq!(at_once, [true, false, true, false]);
        assert!(!servers.has_untried(), "both were asked, and neither has the room");
        // A failed attempt also counts as waiting.
        servers.moved("b".to_owned());
        servers.lost();
        assert!(servers.moved("b".to_owned()));
    }

    #[test]
    fn endless_moves_fill_no_memory() {
        let mut servers = seated(&[]);
        for number in 0..100 {
            servers.moved(format!("http://b:{number}"));
        }
        assert_eq!(servers.known.len(), NODES_MAX + 1);
    }
}
