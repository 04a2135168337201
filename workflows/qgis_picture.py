"""
Open a project of layers in QGIS itself, without a display, and draw it with its legend.

Needs QGIS and the Python of the system (Debian: ``apt-get install python3-qgis qgis-providers``):
``QT_QPA_PLATFORM=offscreen /usr/bin/python3 workflows/qgis_picture.py risk.qgz picture.png``.
A third argument, ``form.png``, draws the form of an inspection too. It ends with code 1 if the
project or one of its layers cannot be read.
"""

import os
import sys

from qgis.core import (
    QgsApplication,
    QgsLayoutExporter,
    QgsLayoutItemLegend,
    QgsLayoutItemMap,
    QgsPrintLayout,
    QgsProject,
)
from qgis.gui import QgsAttributeForm, QgsGui
from qgis.PyQt.QtCore import QRectF, QSize


def main(project: str, picture: str, form: str = "") -> int:
    """Print every layer with its classes and aliases, draw all of them, return the exit code."""
    application = QgsApplication([], bool(form))
    application.initQgis()
    opened = QgsProject.instance()
    if not opened.read(project):
        print(f"{project}: cannot be read")
        return 1
    layers = [node.layer() for node in opened.layerTreeRoot().findLayers()]
    for layer in layers:
        aliases = [layer.attributeDisplayName(i) for i in range(layer.fields().count())]
        print(layer.name(), layer.isValid(), layer.featureCount(), ", ".join(aliases))
    print(f"reference system {opened.crs().authid()}")
    (pairs,) = (layer for layer in layers if layer.name() == "pairs")
    _draw(opened, layers, pairs.extent(), picture)
    if form:
        (inspections,) = (layer for layer in layers if layer.name() == "inspections")
        _draw_form(application, inspections, form)
    return 0 if all(layer.isValid() for layer in layers) else 1


def _draw_form(application, layer, picture):
    """Draw the form of the worst pair as it opens in the field."""
    QgsGui.editorWidgetRegistry().initEditors()
    layer.startEditing()
    form = QgsAttributeForm(layer, next(layer.getFeatures()))
    form.resize(QSize(560, 420))
    form.show()
    application.processEvents()
    form.grab().save(picture)


def _draw(project, layers, extent, picture):
    """Draw the surroundings of the pairs, and the legend next to them."""
    layout = QgsPrintLayout(project)
    layout.initializeDefaults()
    # A4, landscape, in millimetres
    page = QgsLayoutItemMap(layout)
    page.attemptSetSceneRect(QRectF(5, 5, 200, 195))
    page.setCrs(project.crs())
    page.setLayers(layers)
    extent.scale(1.1)
    page.zoomToExtent(extent)
    layout.addLayoutItem(page)
    legend = QgsLayoutItemLegend(layout)
    legend.setLinkedMap(page)
    legend.attemptSetSceneRect(QRectF(210, 5, 80, 195))
    layout.addLayoutItem(legend)
    settings = QgsLayoutExporter.ImageExportSettings()
    settings.dpi = 100
    QgsLayoutExporter(layout).exportToImage(picture, settings)


if __name__ == "__main__":
    code = main(*sys.argv[1:])
    sys.stdout.flush()
    # Destructors of QGIS without a window may crash after everything is done
    os._exit(code)
