"""What stands around the fragments of C++ in the pages, so that a compiler takes them: (before, after)."""

DEFINITION = """service com.example.robot
stdver 0.10
object Arm
end
object Robot
    property double speed
    function void Drive(double velocity, double radius)
    event Bump()
    objref Arm{string} arms
end
"""

INCLUDES = """
#include <iostream>
#include "com__example__robot.hpp"
#include "rrgate/beast.hpp"
#include "rrgate/client.hpp"
#include "rrgate/device.hpp"
#include "rrgate/subscribe.hpp"
using namespace com::example::robot;
"""

FRAMES = {
    ("docs/definition-tools.md", "const auto object = co_await"):
        ("boost::asio::awaitable<void> typed(boost::asio::io_context& io, std::string url) {\n", "}\n"),
    ("docs/device-author.md", "// A coroutine"):
        ("struct { boost::asio::awaitable<void> async_home(double); } motors;\n"
         "struct { double capture(std::int32_t) { return 0; } } camera;\n"
         "struct { void on_settled(std::function<void(double)>) {} } scale;\n"
         "void slow(const std::shared_ptr<rr::Service>& service) {\n", "}\n"),
    ("docs/device-author.md", "const auto bumped"): ("void waits(RobotClient robot) {\n", "}\n"),
    ("docs/device-author.md", "rr::SecurityPolicy policy"): ("void has_users(const std::shared_ptr<rr::Service>& service) {\n", "}\n"),
    ("docs/device-author.md", "node.accept"):
        ("void hands_over(rr::Node& node, boost::beast::websocket::stream<boost::beast::tcp_stream> websocket) {\n", "}\n"),
    ("docs/discovery.md", "rr::Node node"): ("void announces(const std::shared_ptr<rr::Service>& service) {\n", "}\n"),
    ("docs/discovery.md", "rr::ServiceSubscriptionFilter"): ("void follows(rr::Discovery& discovery) {\n", "}\n"),
    ("docs/subscriptions.md", "boost::asio::awaitable<void> warm_up"): ("", ""),
    ("docs/tls.md", "// Of the file name"): ("void is_proven() {\n", "}\n"),
}
