"""Texts of the page in Spanish, by the keys of the English ones."""

SPANISH: dict[str, str] = {
    "simulated": "Movimiento SIMULADO: un ejercicio, no un sismo ocurrido.",
    "skip": "a la tabla de pares",
    "summary": "resumen",
    "do_first": "Qué hacer primero",
    "how_sure": "Qué tan seguro es",
    "number_pounding": "pares chocan, con seguridad o probablemente",
    "number_pounding_one": "par choca, con seguridad o probablemente",
    "number_expected": "choques esperados",
    "number_expected_one": "choque esperado",
    "number_severe": "en la peor clase: {name}",
    "number_velocity": "impacto esperado más rápido",
    "number_buildings": "edificios que un vecino puede golpear",
    "number_buildings_one": "edificio que un vecino puede golpear",
    "event_magnitude": "Magnitud {value}",
    "event_time": "Los registros empiezan {time} UTC",
    "event_place": "epicentro {latitude}°, {longitude}°",
    "event_depth": "profundidad {value} km",
    "revision": "Revisión {value}",
    "revision_time": "Revisión {value}, {time} UTC",
    "stations_expected": "{count} estaciones esperadas",
    "stations_expected_one": "{count} estación esperada",
    "stations_used": "{count} usadas",
    "stations_used_one": "{count} usada",
    "stations_missing_one": "{count} ausente o rechazada",
    "stations_missing": "{count} ausentes o rechazadas",
    "and_more": "y {count} más",
    "todo_exercise": "No envíe a nadie: el movimiento es simulado.",
    "todo_worst": "Inspeccione primero los pares con los impactos más rápidos: {names}.",
    "todo_buildings": "Inspeccione primero estos edificios: {names}.",
    "todo_areas": "Empiece en las zonas con más choques esperados: {names}.",
    "todo_unknown": "Mida {count} separaciones desconocidas: sin ellas no hay veredicto.",
    "todo_unknown_one": "Mida {count} separación desconocida: sin ella no hay veredicto.",
    "todo_possible_one": "Después revise {count} par con choque posible pero no probable.",
    "todo_possible": "Después revise los {count} pares con choque posible pero no probable.",
    "todo_none": "Es probable que ningún par choque; revise los posibles.",
    "sure_expected": (
        "Se esperan {mean} pares con choque; la desviación estándar está entre {low} (pares "
        "independientes) y {high} (una sola causa)."
    ),
    "sure_expected_one": (
        "Se espera {mean} par con choque; la desviación estándar está entre {low} (pares "
        "independientes) y {high} (una sola causa)."
    ),
    "sure_derived_one": "{count} de {all} pares tiene datos derivados, no medidos.",
    "sure_far_one": "{count} par usa una estación lejana.",
    "sure_periods_one": "{count} par tiene un período fuera de los utilizables de su registro.",
    "sure_station_class_one": "{count} par usa el registro de otra clase de sitio.",
    "sure_record_one": "{count} par usa un registro con advertencia: vea las estaciones.",
    "sure_map_one": "{count} par no tiene estación cercana: un ShakeMap da su demanda.",
    "sure_derived": "{count} de {all} pares tienen datos derivados, no medidos.",
    "sure_far": "{count} pares usan una estación lejana.",
    "sure_periods": "{count} pares tienen un período fuera de los utilizables de su registro.",
    "sure_station_class": "{count} pares usan el registro de otra clase de sitio.",
    "sure_record": "{count} pares usan un registro con advertencia: vea las estaciones.",
    "sure_map": "{count} pares no tienen estación cercana: un ShakeMap da su demanda.",
    "sure_distance": "Los registros están a {value} km de los pares (mediana).",
    "sure_nature": "Dos osciladores representan cada par; no se calcula el daño de los edificios.",
    "map": "Mapa de los pares",
    "map_help": (
        "Mapa de los pares. Las flechas lo mueven, más y menos lo amplían y reducen, Inicio "
        "muestra todo. La tabla de abajo contiene los mismos pares."
    ),
    "nearer": "ampliar",
    "further": "reducir",
    "whole": "mostrar todo",
    "station": "estación",
    "epicentre": "epicentro",
    "cells_note": (
        "Los {shown} peores de {all} pares se dibujan uno por uno; los demás se cuentan en "
        "celdas, con el color de la peor clase en ellas. Siguen los filtros de severidad y choque."
    ),
    "cells_hidden": (
        "Los {shown} peores de {all} pares se dibujan uno por uno. Los demás son cuentas por "
        "celda, ahora ocultas: hay un filtro que las cuentas no pueden seguir."
    ),
    "pairs": "Pares, los peores primero",
    "state": "choque",
    "risk_class": "severidad",
    "legend": "Severidad, por impacto esperado:",
    "any": "todas",
    "least_probability": "probabilidad desde, %",
    "least_velocity": "impacto desde, cm/s",
    "area": "zona",
    "flag": "marca",
    "search": "buscar",
    "search_hint": "identificador, lugar, o latitud, longitud",
    "flags_any": "con alguna de estas",
    "flags_all": "con todas estas",
    "flags_none": "sin ninguna de estas",
    "flags_chosen": "{label}: {count}",
    "export_lacks": "A la exportación le falta la columna {names}: están en risk.csv.",
    "count": "{found} de {shown} pares de esta página ({all} evaluados)",
    "export": "exportar como CSV",
    "clear": "quitar filtros",
    "more": "más filas",
    "column_rank": "rango",
    "column_pair_id": "par",
    "column_risk_class": "severidad",
    "column_state": "choque",
    "column_probability": "probabilidad, %",
    "column_expected_impact_velocity": "impacto, cm/s",
    "column_gap": "separación, cm",
    "column_demand": "necesaria, cm",
    "column_missing_gap": "falta, cm",
    "column_expected_amplification": "amplificación",
    "column_station": "estación",
    "state_yes": "seguro",
    "state_likely": "probable",
    "state_possible": "posible",
    "state_unlikely": "improbable",
    "state_no": "no",
    "state_unknown": "separación desconocida",
    "class_severe": "severa",
    "class_high": "alta",
    "class_moderate": "moderada",
    "class_low": "baja",
    "class_gap unknown": "separación desconocida",
    "pair": "Par",
    "building": "Edificio",
    "close": "cerrar",
    "says_probability": "La probabilidad de choque en este evento es {value} %.",
    "says_probability_design": "La probabilidad de choque con este espectro es {value} %.",
    "says_probability_ensemble": (
        "La probabilidad de choque, si ocurre uno de los escenarios, es {value} %."
    ),
    "says_velocity": (
        "Se espera que los edificios se encuentren a {value} cm/s; en 84 de 100 casos a lo sumo a "
        "{high} cm/s."
    ),
    "says_velocity_alone": "Se espera que los edificios se encuentren a {value} cm/s.",
    "says_touching": "Los edificios se tocan: la separación es 0 cm.",
    "says_gap": "La separación es {value} cm.",
    "says_no_gap": "La separación es desconocida.",
    "says_demand": "La separación necesaria es {value} cm ({rule}).",
    "says_impacts": "La historia exacta tiene {count} impactos, el más rápido a {velocity} cm/s.",
    "says_impacts_one": "La historia exacta tiene {count} impacto, a {velocity} cm/s.",
    "says_amplification": "El choque multiplica el movimiento de uno de ellos por {value}.",
    "says_address": "Lugar: {value}.",
    "says_station": "Registro de la estación {station}, a {value} km.",
    "rule_exact": "exacta para el registro",
    "rule_per_white_noise": "estimada con PER",
    "rule_per_record": "estimada con PER y la correlación del registro",
    "rule_linearized": "estimada para edificios que fluyen",
    "rule_srss": "SRSS, porque un período es derivado",
    "rule_shakemap": "de un ShakeMap",
    "rule_sd_white_noise": "estimada con el espectro",
    "rule_sd_srss": "SRSS del espectro, porque un período es derivado",
    "rule_": "regla desconocida",
    "both_buildings": "Ambos edificios",
    "fact_building_id": "edificio",
    "fact_height": "altura, m",
    "fact_storeys": "pisos",
    "fact_period": "período, s",
    "fact_damping": "amortiguamiento, %",
    "fact_participation": "participación a la altura de contacto",
    "fact_per": "PER, cm",
    "fact_sd": "SD, cm",
    "fact_amplification_exact": "movimiento con / sin choque",
    "circles_gap": "Círculos de energía con la separación que hay, {value} cm",
    "circles_needed": "Círculos de energía con la separación necesaria, {value} cm",
    "circles_note": (
        "Radio: el mayor movimiento de cada edificio a la altura de contacto, como energía (PER). "
        "Líneas: las caras de los edificios en reposo. El edificio 2 va a trazos."
    ),
    "history": "Desplazamientos en el tiempo, cm, y {count} impactos",
    "history_one": "Desplazamientos en el tiempo, cm, y {count} impacto",
    "history_note": (
        "Edificio 1 continuo, edificio 2 a trazos y a una separación de distancia; barras abajo: "
        "impactos, más altas cuanto más rápidos. Sigue el registro; tras unos diez impactos dos "
        "programas correctos pueden diferir."
    ),
    "history_apart": (
        "Con los datos de esta página no se tocan, como cuando ambos períodos son iguales; la "
        "probabilidad cuenta los otros valores que los datos pueden tener."
    ),
    "no_history": (
        "La página contiene las historias de los {count} peores pares con separación conocida y "
        "registro. Para este par, en la carpeta de los resultados: {command}"
    ),
    "prevention": "Qué lo habría evitado",
    "prevention_design": "Qué lo evitaría",
    "prevention_ensemble": "Qué lo evitaría",
    "prevents_gap": "{value} cm más de separación, {whole} cm en total.",
    "prevents_damping": "{value} % del amortiguamiento crítico añadido a ambos edificios.",
    "prevents_no_damping": "Solo amortiguamiento no basta: 40 % del crítico es muy poco.",
    "prevents_bumper": (
        "Topes no lo evitan pero lo suavizan: restitución a lo sumo {value} (estimación)."
    ),
    "prevents_without_record": "Amortiguamiento y topes: no se calculan sin registro.",
    "prevents_unknown_gap": (
        "La separación es desconocida: mídala primero. La separación necesaria es {whole} cm."
    ),
    "prevents_unknown_gap_ensemble": "La separación es desconocida: mídala primero.",
    "prevents_not_computed": "No se calculó para este par.",
    "prevents_not_computed_ensemble": (
        "No se calcula para varios escenarios juntos: vea los resultados del peor, {name}."
    ),
    "prevents_in_doubt": (
        "La separación de {gap} cm basta para los datos más probables, que necesitan {whole} cm. "
        "La probabilidad cuenta otros valores de los datos, con los que no basta."
    ),
    "prevents_nothing": (
        "En este evento no hace falta nada: la separación es {gap} cm, la necesaria {whole} cm."
    ),
    "prevents_nothing_design": (
        "Con este espectro no hace falta nada: la separación es {gap} cm, la necesaria {whole} cm."
    ),
    "flags": "Marcas",
    "derived": "Datos derivados",
    "derived_spread": (
        "Los períodos derivados son inciertos: sus desviaciones estándar logarítmicas son "
        "{first} % y {second} %, y la probabilidad las incluye."
    ),
    "derived_fixed": "Su incertidumbre no es parte de la probabilidad.",
    "sensitivity": "Si un dato tuviera otro valor",
    "sensitivity_note": (
        "Cada dato solo, en el valor que no supera en 16, y en 84, de 100 casos; todo lo demás "
        "sigue tan incierto como es."
    ),
    "sensitivity_none": (
        "Calculado para los {worst} peores pares y los {doubtful} más dudosos, no para este."
    ),
    "sensitivity_fixed": (
        "No se conoce desviación de: {names}. La probabilidad los toma como exactos."
    ),
    "column_input": "dato",
    "column_low": "con 16 de 100",
    "column_high": "con 84 de 100",
    "column_then": "entonces",
    "chance_and_state": "{chance} %, {state}",
    "other_pairs": "Sus otros pares:",
    "building_says": (
        "Rango {rank} de los edificios; vecinos que pueden golpearlo: {hit} de {neighbours}; la "
        "probabilidad de que uno lo haga es al menos {probability} %."
    ),
    "building_impacts": "En su fila recibe {count} golpes, de hasta {velocity} cm/s.",
    "building_impacts_one": "En su fila recibe {count} golpe, a {velocity} cm/s.",
    "building_prevention": "Prevención: {value}.",
    "position_inside": "dentro de su fila",
    "position_end": "extremo de su fila",
    "position_corner": "esquina de dos filas",
    "position_single": "un solo par",
    "station_pairs": "Su registro sirve a {count} pares.",
    "station_pairs_one": "Su registro sirve a {count} par.",
    "station_record": "Aceleración procesada, m/s²: norte arriba, este abajo",
    "station_record_note": (
        "Cada intervalo de {value} s se dibuja de su menor a su mayor muestra: ningún máximo se "
        "pierde."
    ),
    "station_spectra": (
        "PER (continuo) y SD (a trazos) con {value} % de amortiguamiento, cm, según el período, s"
    ),
    "station_spectra_note": (
        "La horizontal mayor. Sombreado: períodos no utilizables. Un PER muy por encima de SD "
        "viene de movimiento lento, cuya velocidad también entra en PER."
    ),
    "station_none_one": "La página dibuja la {count} estación que sirve a más pares.",
    "station_none": "La página dibuja las {count} estaciones que sirven a más pares.",
    "station_clear": "Ninguna revisión de su registro falló.",
    "show_pairs": "filtrar sus pares",
    "input_system": "sistema estructural",
    "input_period": "período",
    "input_damping": "amortiguamiento",
    "input_mass": "masa",
    "input_area": "área de planta",
    "input_height": "altura",
    "input_storeys": "pisos",
    "input_participation": "participación",
    "input_yield_displacement": "desplazamiento de fluencia",
    "input_contact_height": "altura de contacto",
    "input_floor_offset": "desfase de losas",
    "input_restitution": "restitución",
    "input_gap": "separación",
    "input_gap_std": "desviación de la separación",
    "stations": "Estaciones",
    "areas": "Zonas",
    "rejected": "Rechazado, con razones",
    "rejected_none": "No se rechazó nada.",
    "rejected_some_one": "{shown} de {all} rechazo; también está en rejected.csv.",
    "rejected_some": "{shown} de {all} rechazos; todos están en rejected.csv.",
    "provenance": "De dónde viene esto",
    "head_station": "estación",
    "head_state": "estado",
    "head_pairs": "pares",
    "head_pga": "PGA, m/s²",
    "head_pgv": "PGV, m/s",
    "head_per": "PER (1 s), cm",
    "head_sd": "SD (1 s), cm",
    "head_shortest_usable_period": "utilizable desde, s",
    "head_longest_usable_period": "hasta, s",
    "head_warnings": "advertencias y razones",
    "head_area": "zona",
    "head_yes": "seguro",
    "head_likely": "probable",
    "head_possible": "posible",
    "head_expected_pounding": "esperados",
    "head_worst_pair": "peor par",
    "head_worst_expected_impact_velocity": "su impacto, m/s",
    "head_kind": "tipo",
    "head_name": "nombre",
    "head_source": "fuente",
    "head_row": "fila",
    "head_reasons": "razones",
    "made_with": "hecho con",
    "files": "archivos junto a esta página",
    "files_list": "risk.parquet o risk/, stations.csv, rejected.csv, run.json (con huellas)",
    "configuration": "configuración",
    "station_used": "usada",
    "station_rejected": "rechazada",
    "flag_unknown_gap": (
        "la tabla no da separación: la demanda es la separación necesaria; probabilidad, estado e "
        "impactos están vacíos o son los de la separación que supone la configuración"
    ),
    "flag_doubtful_cell": (
        "una celda de la tabla de pares no se entendió y queda vacía, o la separación es un rango, "
        "una estimación o un límite: vea cell_notes"
    ),
    "flag_touching": "separación 0: el golpe único está fuera de su rango confiable",
    "flag_learned_outlines": (
        "un contorno fue aprendido de imágenes, que no muestran que una separación baste: el "
        "estado no es no"
    ),
    "flag_single_hit_unreliable": (
        "separación menor que 0.6 de la demanda: probablemente varios impactos, el golpe único "
        "puede quedar corto"
    ),
    "flag_outside_usable_periods": (
        "el período de un edificio está fuera de los períodos utilizables del registro"
    ),
    "flag_per_far_above_sd": (
        "PER/SD sobre el límite configurado: una separación según PER es demasiado grande"
    ),
    "flag_far_station": "la estación está más lejos que la distancia configurada para esta marca",
    "flag_one_horizontal": (
        "la estación tiene una horizontal: se usa su azimut, cualquiera que sea el del par"
    ),
    "flag_unknown_azimuths": (
        "los azimuts de las horizontales de la estación son desconocidos: la demanda es la mayor "
        "de todos, y su azimut se mide desde el primer sensor"
    ),
    "flag_derived_inputs": "la fila tiene datos derivados, nombrados en la columna derived",
    "flag_derived_period": (
        "un período es derivado: la demanda es al menos SRSS; estado y rango vienen de remuestreo"
    ),
    "flag_linearized_not_converged": (
        "no se halló ductilidad hasta 40: la demanda linealizada es la de 40, a menudo excesiva"
    ),
    "flag_no_damping_suffices": (
        "choca, y ningún amortiguamiento añadido hasta 0.4 del crítico mantiene separados los "
        "edificios"
    ),
    "flag_no_bumper_suffices": (
        "choca, y ninguna restitución mantiene el golpe único dentro de target_amplification"
    ),
    "flag_no_demand": (
        "la demanda es 0 (los osciladores se mueven como uno o no se mueven): no hay razón de "
        "demanda"
    ),
    "flag_floor_to_column": "las losas no coinciden: fuera del método",
    "flag_record_from_other_site_class": (
        "ninguna estación de la clase de sitio del par está al alcance: sirve la más cercana de "
        "otra"
    ),
    "flag_motion_from_other_site_class": (
        "ninguna estación de la clase del sitio dio su movimiento: sirvieron las de otras clases"
    ),
    "flag_shakemap_demand": (
        "ninguna estación al alcance: demanda del SD de un ShakeMap, sin PER, registro ni historia "
        "exacta"
    ),
    "flag_shakemap_assumed_deviation": ("el ShakeMap no da desviación: se supone la configurada"),
    "flag_contradicting_coordinates": (
        "dos fuentes ubican la estación a más de 1 km una de otra: vea stations.csv"
    ),
    "flag_baseline_shift": (
        "la línea base del registro se desplazó durante el sismo: los períodos largos son dudosos"
    ),
    "flag_second_event": "el registro contiene otro evento: su demanda puede ser la de ambos",
    "flag_clipped": (
        "el registro puede haber alcanzado el límite del sensor o del registrador: el movimiento "
        "puede haber sido mayor"
    ),
    "flag_wrapped": "el contador del registro se desbordó: los máximos siguen en su otro extremo",
    "flag_filled": (
        "un vacío del registro fue rellenado durante el sismo: allí se desconoce el movimiento"
    ),
    "flag_implausible_record": (
        "la unidad, el intervalo o las componentes del registro contradicen lo que el suelo puede "
        "hacer, o se contradicen entre sí: vea stations.csv"
    ),
    "flag_assumed_corners": (
        "una frecuencia de corte del registro es supuesta: ni el ruido ni el encabezado la dan"
    ),
    "flag_digitised": (
        "el registro fue digitalizado de película: períodos cortos y largos menos ciertos"
    ),
    "flag_undated": "se desconoce la hora del registro: puede ser de otro sismo",
    "flag_implausible_amplitude": (
        "los picos de la estación difieren más de 4 desviaciones de sus vecinas o de un modelo de "
        "movimiento del suelo: vea stations.csv"
    ),
    "flag_implausible_place": (
        "las coordenadas de la estación son un campo vacío, están intercambiadas o les falta un "
        "signo: vea stations.csv"
    ),
    "flag_repeated_record": (
        "el registro de la estación es el de otra, quizá por un factor: vea stations.csv"
    ),
    "flag_record_warning": ("el registro falló otra revisión que solo advierte: vea stations.csv"),
    "flag_simulated": "el movimiento del suelo es simulado",
    "flag_odd_gap": (
        "la separación supera 3 m, la distancia entre las posiciones, o es menor que su desviación "
        "estándar: vea pair_tables en run.json"
    ),
    "flag_odd_positions": (
        "ambos edificios tienen una sola posición, o posiciones demasiado lejanas para vecinos"
    ),
    "flag_odd_azimuth": "el azimut es perpendicular u opuesto a la línea entre las posiciones",
    "flag_odd_height": (
        "altura, pisos, altura de contacto o desfase de losas posibles pero extraños, como en pies "
        "o centímetros, o pisos con decimales"
    ),
    "flag_odd_period": "un período dista mucho del que sugiere la altura, como una frecuencia",
    "flag_odd_building": (
        "amortiguamiento, masa, resistencia o participación posibles pero extraños, como en por "
        "ciento o toneladas"
    ),
    "flag_repeated_pair": "una fila anterior de la tabla tiene los mismos dos edificios",
    "flag_contradicting_building": (
        "una fila anterior da otros valores u otro lugar a un edificio del mismo building_id"
    ),
    "flagname_unknown_gap": "separación desconocida",
    "flagname_doubtful_cell": "celda dudosa",
    "flagname_touching": "en contacto",
    "flagname_learned_outlines": "contornos aprendidos de imágenes",
    "flagname_single_hit_unreliable": "golpe único poco confiable",
    "flagname_outside_usable_periods": "fuera de períodos utilizables",
    "flagname_per_far_above_sd": "PER muy sobre SD",
    "flagname_far_station": "estación lejana",
    "flagname_one_horizontal": "una horizontal",
    "flagname_unknown_azimuths": "azimuts desconocidos",
    "flagname_derived_inputs": "datos derivados",
    "flagname_derived_period": "período derivado",
    "flagname_linearized_not_converged": "linealización sin convergencia",
    "flagname_no_damping_suffices": "ningún amortiguamiento basta",
    "flagname_no_bumper_suffices": "ningún tope basta",
    "flagname_no_demand": "sin demanda",
    "flagname_odd_gap": "separación extraña",
    "flagname_odd_positions": "posiciones extrañas",
    "flagname_odd_azimuth": "azimut extraño",
    "flagname_odd_height": "altura extraña",
    "flagname_odd_period": "período extraño",
    "flagname_odd_building": "edificio extraño",
    "flagname_repeated_pair": "par repetido",
    "flagname_contradicting_building": "edificio contradictorio",
    "flagname_floor_to_column": "losa contra columna",
    "flagname_record_from_other_site_class": "registro de otra clase de sitio",
    "flagname_motion_from_other_site_class": "movimiento de otra clase de sitio",
    "flagname_shakemap_demand": "demanda de ShakeMap",
    "flagname_shakemap_assumed_deviation": "desviación supuesta del ShakeMap",
    "flagname_contradicting_coordinates": "coordenadas contradictorias",
    "flagname_baseline_shift": "desplazamiento de línea base",
    "flagname_second_event": "segundo evento",
    "flagname_clipped": "saturado",
    "flagname_wrapped": "contador desbordado",
    "flagname_filled": "vacío rellenado",
    "flagname_implausible_record": "registro inverosímil",
    "flagname_assumed_corners": "cortes supuestos",
    "flagname_digitised": "digitalizado",
    "flagname_undated": "sin fecha",
    "flagname_implausible_amplitude": "amplitud inverosímil",
    "flagname_implausible_place": "ubicación inverosímil",
    "flagname_repeated_record": "registro repetido",
    "flagname_record_warning": "advertencia del registro",
    "flagname_simulated": "simulado",
    "kind_file": "archivo",
    "kind_record": "registro",
    "kind_station": "estación",
    "kind_service": "servicio",
    "kind_pair": "par",
    "kind_building": "edificio",
    "kind_row": "fila",
}
