#include "server/http/endpoints/sample_jpeg.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/http/endpoints/image_values.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

rr::awaitable<void> encode(std::shared_ptr<SampleJpeg> jpeg, ImageWork work, Workers& workers) {
  const auto encoding = [&work] { return encode_image(work); };
  auto made = co_await workers.run(encoding);
  if (made) {
    jpeg->memory.hold(made->size());
    jpeg->result = std::make_shared<const std::string>(std::move(*made));
  } else {
    jpeg->result = made.error();
  }
  jpeg->done.cancel();
}

}  // namespace

rr::awaitable<JpegImage> jpeg_of(SamplePtr sample, const rr::TypeDefinition& type, const rr::TypeRegistry& types,
                                 MemoryBudget& memory, Workers& workers) {
  auto jpeg = sample->jpeg;
  if (!jpeg) {
    const auto executor = co_await asio::this_coro::executor;
    sample->jpeg = jpeg = std::make_shared<SampleJpeg>(executor, memory.charge(""));
    auto work = prepare_image(sample->values.at(0), type, types, jpeg_type);
    if (work)
      asio::co_spawn(executor, encode(jpeg, std::move(*work), workers), asio::detached);
    else
      jpeg->result = work.error();
  }
  while (!jpeg->result) co_await jpeg->done.async_wait(asio::as_tuple(asio::use_awaitable));
  co_return *jpeg->result;
}

}  // namespace rrgate
