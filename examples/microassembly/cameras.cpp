#include "cameras.hpp"

namespace microassembly {

Cameras::Cameras(Finder& finder)
    : stages_(finder.subscribe("Stages")),
      poses_(stages_.wire(&definition::StagesAsyncClient::poses)),
      illuminators_(finder.subscribe("Illuminators")) {
  for (std::size_t i = 0; i < microscope_count; ++i) microscopes_.push_back(std::make_shared<Microscope>());
}

void Cameras::take_pictures() {
  if (const auto client = illuminators_.default_client())
    definition::IlluminatorsAsyncClient(*client).levels().get([this](std::exception_ptr failure, Numbers levels) {
      if (!failure) levels_ = std::move(levels);
    });
  else
    levels_.assign(illuminator_count, 0);
  const auto probes = stages_.default_client() ? poses_.value().value_or(Poses()) : Poses();
  for (std::size_t i = 0; i < microscopes_.size(); ++i)
    microscopes_[i]->picture(look(i, probes, i < focus_.size() ? focus_[i] : 1, levels_));
}

void Cameras::set_focus(Numbers focus) {
  check_numbers("heights", focus, focus_count, 0, 2);
  focus_ = std::move(focus);
}

std::shared_ptr<definition::MicroscopeService> Cameras::get_microscopes(std::int32_t index) {
  if (index < 0 || static_cast<std::size_t>(index) >= microscopes_.size()) return nullptr;
  return microscopes_[static_cast<std::size_t>(index)];
}

}  // namespace microassembly
