"""What drivers of cameras take for OpenCV: a film of one colour, whose blue is the brightness of the camera."""
import io
import time

import numpy as np
from PIL import Image

(CAP_PROP_FRAME_WIDTH, CAP_PROP_FRAME_HEIGHT, CAP_PROP_FPS, CAP_PROP_FOCUS, CAP_PROP_EXPOSURE, CAP_PROP_GAIN, CAP_PROP_BRIGHTNESS,
 CAP_PROP_CONTRAST, CAP_PROP_SATURATION, IMWRITE_JPEG_QUALITY) = range(10)
RED, GREEN = 50, 100


class VideoCapture:
    def __init__(self, device):
        self._settings = {}

    def isOpened(self):
        return True

    def set(self, setting, value):
        self._settings[setting] = value

    def get(self, setting):
        return float(self._settings.get(setting, 0))

    def read(self):
        time.sleep(1 / self.get(CAP_PROP_FPS))
        size = (int(self.get(CAP_PROP_FRAME_HEIGHT)), int(self.get(CAP_PROP_FRAME_WIDTH)), 3)
        return True, np.full(size, (self.get(CAP_PROP_BRIGHTNESS), GREEN, RED), np.uint8)

    def release(self):
        pass


def imencode(ending, picture, parameters):
    made = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(picture[..., ::-1])).save(made, "JPEG", quality=parameters[1])
    return True, np.frombuffer(made.getvalue(), np.uint8)
