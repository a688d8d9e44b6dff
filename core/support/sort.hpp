// Sorting in little code for WebAssembly, where each std::sort() is a kilobyte to load. Layer: support.
#pragma once

#include <algorithm>
#include <functional>

namespace rr {

/// std::sort() of a range. In WebAssembly a heap sort: a third of the code, about twice the time.
template <class Range, class Before = std::less<>>
void sort(Range& range, Before before = {}) {
#ifdef __EMSCRIPTEN__
  std::make_heap(range.begin(), range.end(), before);
  std::sort_heap(range.begin(), range.end(), before);
#else
  std::sort(range.begin(), range.end(), before);
#endif
}

}  // namespace rr
