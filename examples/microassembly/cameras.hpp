// The microscopes: they see what is on the bench, by the services of the stages and the illuminators. Layer: example.
#pragma once

#include <memory>
#include <vector>

#include "finder.hpp"
#include "parts.hpp"

namespace microassembly {

class Cameras : public definition::CamerasService {
 public:
  explicit Cameras(Finder& finder);
  /// Nothing is seen where there are no stages; without illuminators it is dark.
  void take_pictures();

 private:
  struct Microscope : definition::MicroscopeService {};

  Numbers get_focus() override { return focus_; }
  void set_focus(Numbers focus) override;
  std::shared_ptr<definition::MicroscopeService> get_microscopes(std::int32_t index) override;

  rr::ServiceSubscription stages_;
  rr::TypedWireSubscription<Poses> poses_;
  rr::ServiceSubscription illuminators_;
  Numbers focus_ = Numbers(focus_count, 1);
  Numbers levels_ = Numbers(illuminator_count, 0);
  std::vector<std::shared_ptr<Microscope>> microscopes_;
};

}  // namespace microassembly
