#include "server/state/admission.hpp"

#include <catch2/catch.hpp>

using namespace rrgate;

namespace {

const auto here = Admission::Address(boost::asio::ip::make_address("192.0.2.1"));
const auto there = Admission::Address(boost::asio::ip::make_address("192.0.2.2"));

}  // namespace

TEST_CASE("so many connections in all") {
  Admission admission(2, 10);
  auto first = admission.admit(here);
  const auto second = admission.admit(there);
  CHECK(first);
  CHECK(second);
  CHECK_FALSE(admission.admit(here));
  CHECK_FALSE(admission.admit(std::nullopt));
  first.reset();
  CHECK(admission.open() == 1);
  CHECK(admission.admit(std::nullopt));
}

TEST_CASE("so many connections of an address") {
  Admission admission(10, 1);
  auto first = admission.admit(here);
  CHECK_FALSE(admission.admit(here));
  CHECK(admission.admit(there));
  CHECK(admission.open() == 1);  // one that was not kept counts no longer
  first.reset();
  CHECK(admission.admit(here));
  CHECK(admission.open() == 0);
}

TEST_CASE("a proxy's connection counts in all alone, until its client is known") {
  Admission admission(10, 1);
  auto first = admission.admit(std::nullopt);
  auto second = admission.admit(std::nullopt);
  CHECK(first->pass_to(here));
  CHECK(first->pass_to(here));  // the same one again
  CHECK_FALSE(second->pass_to(here));
  CHECK_FALSE(admission.admit(here));
  CHECK(second->pass_to(there));
  first.reset();
  CHECK(admission.admit(here));
  CHECK(second->pass_to(here));  // from one client to the next, on a connection that a proxy keeps
  CHECK_FALSE(admission.admit(here));
  CHECK(admission.admit(there));
}

TEST_CASE("a network of IPv6 is one address") {
  Admission admission(10, 1);
  const auto from = [](const char* address) { return std::optional(boost::asio::ip::make_address(address)); };
  const auto first = admission.admit(from("2001:db8::1"));
  CHECK(first);
  CHECK_FALSE(admission.admit(from("2001:db8::2:3")));
  CHECK(admission.admit(from("2001:db8:0:1::1")));
  auto proxied = admission.admit(std::nullopt);
  CHECK_FALSE(proxied->pass_to(*from("2001:db8::4")));
  const auto mapped = admission.admit(from("::ffff:192.0.2.1"));
  CHECK(mapped);
  CHECK_FALSE(admission.admit(here));
}

TEST_CASE("limits that change hold for who comes next") {
  Admission admission(1, 1);
  const auto first = admission.admit(here);
  CHECK_FALSE(admission.admit(here));
  admission.set_limits(2, 2);
  const auto second = admission.admit(here);
  CHECK(second);
  admission.set_limits(1, 1);
  CHECK(admission.open() == 2);
  CHECK_FALSE(admission.admit(there));
}
