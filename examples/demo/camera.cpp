#include "examples/demo/camera.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace rrgate::demo {

namespace {

/// Something upright that a column's ray meets.
struct Hit {
  double depth = 0;  ///< along the camera's axis, mm
  double height = 0;
  Color color;  ///< lit
};

struct View {
  Point position;
  Point axis;   ///< unit vector, where the camera looks
  Point right;  ///< unit vector, to the right of it
  double focal_length;
  double center_column;
  double center_row;
};

constexpr double near_plane = 5;        // mm; nothing nearer is drawn
constexpr double fog_distance = 9'000;  // mm at which colours are half gone
constexpr double panel_width = 500;     // mm between the joints on walls
constexpr double tile_size = 500;       // mm, floor
constexpr Point light{0.5547, 0.8321};  // unit vector towards the light
constexpr Color haze{206, 214, 224};

std::uint8_t to_channel(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
}

Color mix(Color a, Color b, double share_of_b) {
  const auto channel = [&](std::uint8_t from, std::uint8_t to) { return to_channel(from + (to - from) * share_of_b); };
  return {channel(a.red, b.red), channel(a.green, b.green), channel(a.blue, b.blue)};
}

Color scaled(Color color, double factor) {
  return {to_channel(color.red * factor), to_channel(color.green * factor), to_channel(color.blue * factor)};
}

Color in_fog(Color color, double depth) {
  return mix(color, haze, depth / (depth + fog_distance));
}

/// Brighter the more a surface faces the light; never dark.
Color lit(Color color, Point normal) {
  return scaled(color, 0.8 + 0.2 * dot(normal, light));
}

std::optional<Hit> cast(const Wall& wall, const View& view, Point ray) {
  const Point along = wall.to - wall.from;
  const double denominator = cross(ray, along);
  if (std::abs(denominator) < 1e-9) return {};
  const Point to_wall = wall.from - view.position;
  const double depth = cross(to_wall, along) / denominator;  // `ray` advances one unit of depth a unit
  const double t = cross(to_wall, ray) / denominator;
  if (depth < near_plane || t < 0 || t > 1) return {};
  const double size = length(along);
  Point normal{-along.y / size, along.x / size};
  if (dot(normal, ray) > 0) normal = normal * -1;
  const double into_panel = std::fmod(t * size, panel_width);
  const double joint = into_panel < 12 ? 0.75 : 1.0;
  return Hit{depth, wall.height, in_fog(scaled(lit(wall.color, normal), joint), depth)};
}

std::optional<Hit> cast(const Obstacle& obstacle, const View& view, Point ray) {
  const Point to_center = obstacle.center - view.position;
  const double a = dot(ray, ray);
  const double b = dot(ray, to_center);
  const double discriminant = b * b - a * (dot(to_center, to_center) - obstacle.radius * obstacle.radius);
  if (discriminant < 0) return {};
  const double depth = (b - std::sqrt(discriminant)) / a;
  if (depth < near_plane) return {};
  const Point normal = (view.position + ray * depth - obstacle.center) * (1 / obstacle.radius);
  return Hit{depth, obstacle.height, in_fog(lit(obstacle.color, normal), depth)};
}

class Painter {
 public:
  Painter(const World& world, const View& view, const Camera& camera) : world_(world), view_(view), camera_(camera) {
    image_.width = camera.width;
    image_.height = camera.height_pixels;
    image_.step = image_.width * 3;
    image_.data.resize(static_cast<std::size_t>(image_.step) * static_cast<std::size_t>(image_.height));
  }

  Image paint() {
    for (int row = 0; row < image_.height; ++row) paint_background(row);
    for (int column = 0; column < image_.width; ++column) paint_objects(column);
    return std::move(image_);
  }

 private:
  void set(int column, int row, Color color) {
    auto* pixel = image_.data.data() + static_cast<std::ptrdiff_t>(row) * image_.step + column * 3;
    pixel[0] = color.blue;
    pixel[1] = color.green;
    pixel[2] = color.red;
  }

  void paint_background(int row) {
    const double below_horizon = row + 0.5 - view_.center_row;
    if (below_horizon <= 0) {
      constexpr Color zenith{92, 140, 196};
      const Color sky = mix(haze, zenith, -below_horizon / view_.center_row);
      for (int column = 0; column < image_.width; ++column) set(column, row, sky);
      return;
    }
    const double depth = view_.focal_length * camera_.height / below_horizon;
    const Color light_tile = in_fog({152, 150, 144}, depth);
    const Color dark_tile = in_fog({128, 126, 122}, depth);
    const Point start = view_.position + view_.axis * depth;
    const double pixel_width = depth / view_.focal_length;
    for (int column = 0; column < image_.width; ++column) {
      const Point floor = start + view_.right * ((column + 0.5 - view_.center_column) * pixel_width);
      const auto tile = static_cast<long>(std::floor(floor.x / tile_size) + std::floor(floor.y / tile_size));
      set(column, row, tile % 2 == 0 ? light_tile : dark_tile);
    }
  }

  void paint_objects(int column) {
    const Point ray = view_.axis + view_.right * ((column + 0.5 - view_.center_column) / view_.focal_length);
    hits_.clear();
    for (const Wall& wall : world_.walls)
      if (const auto hit = cast(wall, view_, ray)) hits_.push_back(*hit);
    for (const Obstacle& obstacle : world_.obstacles)
      if (const auto hit = cast(obstacle, view_, ray)) hits_.push_back(*hit);
    // From far to near: a low obstacle leaves the top of the wall behind it to be seen.
    std::sort(hits_.begin(), hits_.end(), [](const Hit& a, const Hit& b) { return a.depth > b.depth; });
    for (const Hit& hit : hits_) {
      const double scale = view_.focal_length / hit.depth;
      const int top = to_row(view_.center_row - (hit.height - camera_.height) * scale);
      const int bottom = to_row(view_.center_row + camera_.height * scale);
      for (int row = top; row < bottom; ++row) set(column, row, hit.color);
    }
  }

  int to_row(double position) const {
    return static_cast<int>(std::lround(std::clamp(position, 0.0, static_cast<double>(image_.height))));
  }

  const World& world_;
  const View& view_;
  const Camera& camera_;
  Image image_;
  std::vector<Hit> hits_;
};

}  // namespace

Color Image::at(int column, int row) const {
  const auto* pixel = data.data() + static_cast<std::ptrdiff_t>(row) * step + column * 3;
  return {pixel[2], pixel[1], pixel[0]};
}

double Camera::focal_length() const {
  return width / 2.0 / std::tan(field_of_view / 2);
}

Image render(const World& world, const Pose& pose, const Camera& camera) {
  const Point ahead{std::cos(pose.heading), std::sin(pose.heading)};
  const Point left{-ahead.y, ahead.x};
  const Point axis{std::cos(pose.heading + camera.yaw), std::sin(pose.heading + camera.yaw)};
  const View view{pose.position + ahead * camera.offset.x + left * camera.offset.y,
                  axis,
                  {axis.y, -axis.x},
                  camera.focal_length(),
                  camera.width / 2.0,
                  camera.height_pixels / 2.0};
  return Painter(world, view, camera).paint();
}

}  // namespace rrgate::demo
