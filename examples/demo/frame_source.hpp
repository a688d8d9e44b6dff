// Where the frames of a webcam come from: the demo room, a camera of this machine, or picture files. Layer: demo.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "examples/demo/camera.hpp"

namespace rrgate::demo {

/// A frame is one message, and a node refuses messages of more than 12 MB.
inline constexpr std::size_t max_picture_bytes = 11u * 1024 * 1024;

/// An image, or a sentence that says why there is none.
struct FrameResult {
  Image image = {};
  std::string problem = {};  ///< empty: `image` is there
};

class FrameSource {
 public:
  using Taken = std::function<void(FrameResult)>;

  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// For people.
  virtual std::string name() const = 0;
  /// Asks for the next frame. `taken` is called once, within this call or later on the same thread; not any more when
  /// the source is destroyed. It must not destroy the source.
  virtual void take(Taken taken) = 0;
};

}  // namespace rrgate::demo
