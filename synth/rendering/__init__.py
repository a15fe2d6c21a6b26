"""Pictures as a camera would take them: Mitsuba's light transport, a thin lens, a finite exposure and an EMVA 1288 sensor."""
