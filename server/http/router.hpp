// Which handler answers a path. Layer: server/http. The routes themselves are listed in routes.cpp.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/request.hpp"

namespace rrgate {

/// `rest` is what the pattern's "*" stands for.
using Handler = std::function<Response(const Request& request, std::string_view rest)>;

class Router {
 public:
  /// `pattern` is a whole path, or ends in "*" for everything below it. HEAD is answered where GET is.
  /// The first route that matches path and method wins.
  void add(http::verb method, std::string pattern, Handler handler);

  /// Answers 404 where no pattern fits, and 405 with Allow where only the method doesn't.
  Response answer(const Request& request) const;

 private:
  struct Route {
    http::verb method;
    std::string pattern;
    Handler handler;
  };
  std::vector<Route> routes_;
};

}  // namespace rrgate
