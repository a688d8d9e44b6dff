// gRPC's row of the latency table: an empty call, by its synchronous interface.
//
//   latency_grpc service      prints its port as JSON
//   latency_grpc call PORT    see answer_counts()
#include <grpcpp/grpcpp.h>

#include <stdexcept>
#include <string>
#include <string_view>

#include "nothing.grpc.pb.h"
#include "test/bench/paper/latency.hpp"

namespace {

class Bench final : public bench::Bench::Service {
  grpc::Status Call(grpc::ServerContext*, const bench::Nothing*, bench::Nothing*) override { return grpc::Status::OK; }
};

void serve() {
  Bench service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  if (!server) throw std::runtime_error("gRPC can't listen");
  std::printf("{\"port\": %d}\n", port);
  std::fflush(stdout);
  server->Wait();
}

void call(const std::string& port) {
  const auto stub = bench::Bench::NewStub(grpc::CreateChannel("127.0.0.1:" + port, grpc::InsecureChannelCredentials()));
  const bench::Nothing request;
  rr::bench::answer_counts([&] {
    grpc::ClientContext context;
    bench::Nothing reply;
    if (const auto status = stub->Call(&context, request, &reply); !status.ok())
      throw std::runtime_error(status.error_message());
  });
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view role = argc > 1 ? argv[1] : "";
  try {
    if (role == "service" && argc == 2) {
      serve();
    } else if (role == "call" && argc == 3) {
      call(argv[2]);
    } else {
      std::fprintf(stderr, "usage: latency_grpc service | call PORT\n");
      return 2;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "latency_grpc: %s\n", error.what());
    return 1;
  }
}
