#include "node/http/message.hpp"

#include <algorithm>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/status.hpp>
#include <nlohmann/json.hpp>

#include "core/support/words.hpp"

namespace rrgate {

namespace {

std::string_view view(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

bool has_header(const Response& response, std::string_view name) {
  const auto is_name = [name](const auto& header) { return equals_ignoring_case(header.first, name); };
  return std::any_of(response.headers.begin(), response.headers.end(), is_name);
}

/// What a browser may make of a response that says nothing else itself: no page, no part of another one, no script of
/// another type. What a page of another origin may read, it may show too.
/// Source: Fetch (nosniff, Cross-Origin-Resource-Policy), HTML section 7.1.3, CSP level 3.
std::string format_guards(const Response& response) {
  const bool is_shared = has_header(response, "Access-Control-Allow-Origin");
  const std::pair<std::string_view, std::string_view> guards[] = {
      {"X-Content-Type-Options", "nosniff"},
      {"Referrer-Policy", "no-referrer"},
      {"Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'"},
      {"Cross-Origin-Opener-Policy", "same-origin"},
      {"Cross-Origin-Resource-Policy", is_shared ? "cross-origin" : "same-origin"},
  };
  std::string out;
  for (const auto& [name, value] : guards)
    if (!has_header(response, name)) out += std::string(name) + ": " + std::string(value) + "\r\n";
  return out;
}

}  // namespace

std::string_view HttpRequest::path() const {
  const auto target = view(message.target());
  return target.substr(0, target.find('?'));
}

std::string_view HttpRequest::query() const {
  const auto target = view(message.target());
  const auto question = target.find('?');
  return question == std::string_view::npos ? std::string_view() : target.substr(question + 1);
}

std::string_view HttpRequest::header(http::field name) const {
  return rr::trim(view(message[name]));
}

std::string_view HttpRequest::header(std::string_view name) const {
  const auto found = message.find(boost::beast::string_view(name.data(), name.size()));
  return found == message.end() ? std::string_view() : rr::trim(view(found->value()));
}

std::string HttpRequest::list(http::field name) const {
  std::string out;
  const auto lines = message.equal_range(name);
  for (auto line = lines.first; line != lines.second; ++line)
    out.append(out.empty() ? "" : ", ").append(rr::trim(view(line->value())));
  return out;
}

Response text_response(unsigned status, std::string_view content_type, std::string body) {
  Response response;
  response.status = status;
  response.set("Content-Type", std::string(content_type));
  response.body = std::make_shared<const std::string>(std::move(body));
  return response;
}

Response json_response(unsigned status, std::string json) {
  auto response = text_response(status, "application/json", std::move(json));
  response.set("Cache-Control", "no-store");
  return response;
}

Response problem_response(unsigned status, std::string_view detail) {
  nlohmann::ordered_json problem;
  problem["type"] = "about:blank";
  problem["title"] = std::string(view(http::obsolete_reason(http::int_to_status(status))));
  problem["status"] = status;
  problem["detail"] = std::string(detail);
  auto text = problem.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  auto response = text_response(status, "application/problem+json", std::move(text));
  response.set("Cache-Control", "no-store");
  return response;
}

std::string format_response_head(const Response& response, bool keeps_alive, unsigned http_minor_version) {
  std::string out = http_minor_version == 0 ? "HTTP/1.0 " : "HTTP/1.1 ";
  out += std::to_string(response.status) + ' ';
  out += view(http::obsolete_reason(http::int_to_status(response.status)));
  out += "\r\n";
  for (const auto& [name, value] : response.headers) out += name + ": " + value + "\r\n";
  const bool may_have_body = response.status >= 200 && response.status != 204 && response.status != 304;
  if (response.is_streamed && http_minor_version > 0) out += "Transfer-Encoding: chunked\r\n";
  if (may_have_body && !response.is_streamed)
    out += "Content-Length: " + std::to_string(response.body ? response.body->size() : 0) + "\r\n";
  out += format_guards(response);
  if (!keeps_alive) {
    out += "Connection: close\r\n";
  } else if (http_minor_version == 0) {
    out += "Connection: keep-alive\r\n";
  }
  return out + "\r\n";
}

bool equals_ignoring_case(std::string_view left, std::string_view right) {
  return boost::beast::iequals({left.data(), left.size()}, {right.data(), right.size()});
}

bool has_token(std::string_view list, std::string_view token) {
  while (!list.empty()) {
    const auto comma = list.find(',');
    if (equals_ignoring_case(rr::trim(list.substr(0, comma)), token)) return true;
    if (comma == std::string_view::npos) break;
    list.remove_prefix(comma + 1);
  }
  return false;
}

std::optional<bool> acceptance(std::string_view list, std::string_view name) {
  const auto is_refusal = [](std::string_view parameter) {
    parameter = rr::trim(parameter);
    return equals_ignoring_case(parameter.substr(0, 2), "q=") &&
           parameter.find_first_not_of("0.", 2) == std::string_view::npos;
  };
  for (const auto item : rr::split_words(list, ",")) {
    const auto parts = rr::split_words(item, ";");
    if (!parts.empty() && equals_ignoring_case(rr::trim(parts[0]), name))
      return std::none_of(parts.begin() + 1, parts.end(), is_refusal);
  }
  return std::nullopt;
}

bool accepts(std::string_view list, std::string_view name) {
  return acceptance(list, name).value_or(false);
}

}  // namespace rrgate
